//! Channels that were measured as registered surfaces: a surface per time, and where the model's nodes are without displacement.
//!
//! What is compared is in [`crate::surfaces`]. Next files to read: [`super::surface_place`], [`super::surface_files`], [`super::shapes`].

use std::sync::Arc;

use starlings_models::{Role, Spec, quoted_list};

use super::Context;
use super::noise::unusable;
use super::reader::{ChannelReader, measured_somewhere};
use super::shapes::Surfaces;
use super::surface_files::SurfaceFiles;
use crate::checked::Channel;
use crate::file::{ChannelSection, SurfaceSection};
use crate::surfaces::Node;

impl ChannelReader<'_> {
    /// The channels of a surface, one per node; `None` when a problem was reported.
    pub(super) fn surface(
        &self,
        section: &ChannelSection,
        surface: &SurfaceSection,
        files: &SurfaceFiles,
        context: &mut Context<'_>,
    ) -> Option<Vec<Channel>> {
        self.displacement(section)?;
        let noise = self.surface_noise(section)?;
        let along = self.noise_along(surface, noise)?;
        let output = section.output.get_ref();
        let n = Spec::range_of(&self.spec.outputs, output).map_or(1, |range| range.len());
        let with_ends = Surfaces {
            csv: &files.surface,
            meshes: &files.meshes,
            open_ends: surface.open_ends,
            source: self.source,
            table: self.table,
        };
        let shapes = Arc::new(with_ends.read()?);
        let places = with_ends.rest(&files.rest, n, output)?;
        self.in_place(section, surface, &shapes, &places)?;
        let mut channels = Vec::with_capacity(n);
        for (i, (rest, normal)) in places.into_iter().enumerate() {
            let node = Node { rest, normal, seen: Arc::clone(&shapes) };
            let at = |time: &f64| if node.is_shown(*time) { 0.0 } else { f64::NAN };
            let values: Vec<f64> = self.table.times.iter().map(at).collect();
            // A node that no surface shows counts as not measured.
            if !measured_somewhere(&values) {
                continue;
            }
            let output = if n == 1 { output.clone() } else { format!("{output}[{i}]") };
            channels.push(Channel {
                row: context.row(&output),
                held_out: section.held_out || context.is_held_out(&output),
                output,
                column: surface.file.get_ref().clone(),
                unit: section.unit.as_ref().map(|u| u.get_ref().clone()).filter(|u| !u.is_empty()),
                noise: self.tilted(surface, &node, &values, [noise, along]),
                noise_how: "given in the study".to_owned(),
                noise_found_from: None,
                values,
                node: Some(node),
            });
        }
        if !channels.iter().any(|c| self.has_value(&c.values)) {
            let message = format!(
                "no node of `{}` is shown by a surface of record `{}` where it is fitted",
                surface.rest.get_ref(),
                self.section.name.get_ref()
            );
            let help =
                "surfaces and nodes at rest must lie in the same place, in the same unit; or move `train`";
            self.source.report_with(surface.file.span(), message, help);
            return None;
        }
        context.warnings.push(self.what_is_compared(section, surface, [channels.len(), n]));
        Some(channels)
    }

    /// What a distance to a surface has of the noise across and along the wall: root mean square over the times at which the node is
    /// shown.
    fn tilted(
        &self,
        surface: &SurfaceSection,
        node: &Node,
        values: &[f64],
        [across, along]: [f64; 2],
    ) -> f64 {
        if surface.noise_along.is_none() {
            return across;
        }
        let seen = self.table.times.iter().zip(values).filter(|(_, v)| v.is_finite());
        let squares: Vec<f64> =
            seen.filter_map(|(time, _)| node.noise(*time, across, along)).map(|sd| sd * sd).collect();
        if squares.is_empty() { across } else { (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() }
    }

    /// The noise along the wall, that across it unless the study says otherwise. Nothing after a complaint.
    fn noise_along(&self, surface: &SurfaceSection, across: f64) -> Option<f64> {
        let Some(given) = &surface.noise_along else { return Some(across) };
        let sd = *given.get_ref();
        if sd >= 0.0 && sd.is_finite() {
            return Some(sd);
        }
        let help = "give the standard deviation of the surface's points along the wall, in their unit";
        self.source.report_with(
            given.span(),
            format!("`noise_along` must be zero or more, found {sd}"),
            help,
        );
        None
    }

    /// What stands under the output's name in figures and tables.
    fn what_is_compared(
        &self,
        section: &ChannelSection,
        surface: &SurfaceSection,
        [shown, of]: [usize; 2],
    ) -> String {
        let (output, record) = (section.output.get_ref(), self.section.name.get_ref());
        let file = surface.file.get_ref();
        let lost = match of - shown {
            0 => String::new(),
            lost => format!(" No surface shows {lost} of its {of} nodes."),
        };
        format!(
            "`{output}` in record `{record}` is compared with the surfaces of `{file}`: its predictions are signed distances, \
             zero is observed.{lost}"
        )
    }

    /// Only the displacement of a wall can be compared with a surface; an output without a role is accepted. Nothing after a
    /// complaint.
    fn displacement(&self, section: &ChannelSection) -> Option<()> {
        let quantity = self.quantity(section)?;
        if matches!(quantity.role, Role::Displacement | Role::Other) {
            return Some(());
        }
        let wanted = self.spec.outputs.iter().filter(|q| q.role == Role::Displacement);
        let names: Vec<&str> = wanted.map(|q| q.name.as_str()).collect();
        let message = format!("`{}` is no displacement of a wall that a surface could show", quantity.name);
        let help = match names[..] {
            [] => format!("model `{}` has no such output: measure it by a `column`", self.spec.kind),
            _ => format!("its outputs of that kind: {}", quoted_list(&names)),
        };
        self.source.report_with(section.output.span(), message, help);
        None
    }

    /// The noise of a surface is the scatter of its points along the normal; it cannot be found from the data.
    fn surface_noise(&self, section: &ChannelSection) -> Option<f64> {
        match *section.noise.get_ref() {
            Some(sd) => {
                let Some(message) = unusable(sd, []) else { return Some(sd) };
                let help =
                    "give the standard deviation of the surface along its normal, in the unit of its points";
                self.source.report_with(section.noise.span(), message, help);
            }
            None => self.source.report_with(
                section.noise.span(),
                "the noise of a surface cannot be found from the data",
                "give the standard deviation of the surface along its normal, in the unit of its points",
            ),
        }
        None
    }
}
