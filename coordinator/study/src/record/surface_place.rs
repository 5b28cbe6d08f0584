//! Whether surfaces and nodes at rest are in one place and one unit: how far they are apart, and how wide the vessel is in either.
//!
//! Only the first surface is looked at. Next file to read: [`crate::surfaces`].

use std::sync::Arc;

use super::reader::ChannelReader;
use super::shapes::NodeAtRest;
use crate::file::{ChannelSection, SurfaceSection};
use crate::surfaces::{Node, Shape, Shapes, length};

/// Between this part and this multiple of the nodes' radius, a surface may have moved.
const MOST_TIMES: f64 = 3.0;

/// Units of length and how many millimetres they are.
const UNITS: [(&str, f64); 4] = [("um", 1e-3), ("mm", 1.0), ("cm", 10.0), ("m", 1000.0)];

/// A unit fits where it brings the radius of a surface to that of the nodes up to this factor.
const FITS: f64 = 2.0;

impl ChannelReader<'_> {
    /// Refuses surfaces that are further away from all nodes at rest than either is long, or of quite another radius: they are in
    /// another unit or another place.
    pub(super) fn in_place(
        &self,
        section: &ChannelSection,
        surface: &SurfaceSection,
        shapes: &Arc<Shapes>,
        places: &[NodeAtRest],
    ) -> Option<()> {
        let (Some(time), Some(seen)) = (shapes.times.first(), shapes.lengths.first()) else {
            return Some(());
        };
        let distance = |(rest, normal): &NodeAtRest| {
            Node { rest: *rest, normal: *normal, seen: Arc::clone(shapes) }.distance(*time, 0.0)
        };
        let nearest = places.iter().filter_map(distance).map(f64::abs).fold(f64::INFINITY, f64::min);
        let own = length(places.iter().map(|(rest, _)| *rest));
        // Two nodes may be closer to each other than a wall moves.
        let far = nearest > *seen || places.len() > 2 && nearest > own;
        let (file, rest) = (surface.file.get_ref(), surface.rest.get_ref());
        let wide = radii(&shapes.shapes[0], places).filter(|[seen_radius, radius]| {
            let times = seen_radius / radius;
            // A sheet is thin wherever its nodes are: only where it is short as well it is in another unit.
            times > MOST_TIMES || times < 1.0 / MOST_TIMES && 2.0 * seen < own
        });
        let message = match wide {
            Some([seen_radius, radius]) => format!(
                "the surface of `{file}` at time {time} has a radius of {seen_radius:.4} where the nodes at rest of `{rest}` have \
                 {radius:.4}, {:.3} times that",
                seen_radius / radius
            ),
            None if far => format!(
                "the surface of `{file}` at time {time} is {nearest:.4} away from the nearest node at rest; it is {seen:.4} long, the \
                 nodes reach over {own:.4}"
            ),
            None => return Some(()),
        };
        let help = wide.and_then(|[seen, radius]| self.in_unit(section, seen / radius)).unwrap_or_else(|| {
            format!(
                "surfaces and the nodes of `{rest}` must lie in the same place, in the same unit: numbers in mm are 10 times those in \
                 cm, 1000 times those in m"
            )
        });
        self.source.report_with(surface.file.span(), message, help);
        None
    }

    /// What to multiply the numbers of a surface by that is so many times as wide as it should be, if a unit of length tells it.
    fn in_unit(&self, section: &ChannelSection, times: f64) -> Option<String> {
        let quantity = self.spec.outputs.iter().find(|q| q.name == *section.output.get_ref())?;
        let given = section.unit.as_ref().map(|u| u.get_ref().as_str()).filter(|u| !u.is_empty());
        let wanted = given.unwrap_or(&quantity.unit);
        let (_, millimetres) = UNITS.iter().find(|(name, _)| *name == wanted)?;
        let off = |unit: f64| (millimetres / unit / times).ln().abs();
        let (name, unit) = UNITS.iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
        (off(*unit) <= FITS.ln()).then(|| {
            format!(
                "its numbers are those of {name}, and `{}` is in {wanted}: multiply its points by {}",
                quantity.name,
                unit / millimetres
            )
        })
    }
}

/// The radius of a surface and that of the nodes at rest, counted from the middle of the surface: medians over the nodes that see it.
fn radii(shape: &Shape, places: &[NodeAtRest]) -> Option<[f64; 2]> {
    let pair = |(rest, normal): &NodeAtRest| match shape {
        Shape::Profile(profile) => {
            let foot = profile.foot([rest[0], rest[1]])?;
            (foot.past_end <= 0.0).then_some([foot.point[1], rest[1]])
        }
        Shape::Mesh(mesh) => {
            let [from, to] = mesh.inside(*rest, *normal)?;
            let radius = -0.5 * (from + to);
            (radius > 0.0).then_some([0.5 * (to - from), radius])
        }
    };
    let mut found: Vec<[f64; 2]> = places.iter().filter_map(pair).collect();
    found.sort_by(|a, b| (a[0] / a[1]).total_cmp(&(b[0] / b[1])));
    found.get(found.len() / 2).copied()
}
