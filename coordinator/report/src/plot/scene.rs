//! A scene is two axes and the marks on them; drawing it here is the only place that knows the drawing library.
//!
//! Axis labels are written horizontally, the vertical one above its axis: on a narrow screen that stays readable. A scene
//! has no legend; the caption below a figure names the colours. The `<svg>` element is our own because that of plotters has a fixed
//! size and no name for assistive technology. Next file to read: `figure.rs`.

use plotters::backend::SVGBackend;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Circle, DashedPathElement, PathElement, Polygon, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, IntoFont, RGBColor, ShapeStyle, TRANSPARENT, TextStyle};

use super::super::ReportError;
use super::axis::Axis;
use super::mark::{Mark, Point};
use super::palette::{FIGURE_HEIGHT, FIGURE_WIDTH, GRID, INK, MUTED, SUBUNITS, TEXT};
use super::ticked::Ticked;

/// Drawn text must look right where no font is installed with the page.
const FONT: &str = "Helvetica, Arial, sans-serif";

/// The surface on which scenes are drawn.
pub(crate) type Surface<'b> = DrawingArea<SVGBackend<'b>, Shift>;
type Coordinates = Cartesian2d<Ticked, Ticked>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Coordinates>;

/// Two axes and what is drawn on them.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// What the figure shows, in a few words: the name that assistive technology reads.
    pub(crate) title: String,
    /// What can be seen in it.
    pub(crate) description: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) marks: Vec<Mark>,
}

impl Scene {
    /// The scene as one SVG element of the usual size.
    ///
    /// # Errors
    ///
    /// The drawing library refuses a mark.
    pub(crate) fn svg(&self) -> Result<String, ReportError> {
        let size = (FIGURE_WIDTH, FIGURE_HEIGHT);
        picture(size, &self.title, &self.description, |surface| self.draw(surface))
    }

    /// Draws the scene so that it fills `surface`.
    ///
    /// # Errors
    ///
    /// The drawing library refuses a mark.
    pub(crate) fn draw(&self, surface: &Surface<'_>) -> Result<(), ReportError> {
        let mut chart = self.chart(surface)?;
        for mark in self.marks.iter().filter(|mark| matches!(mark, Mark::Span { .. })) {
            self.draw_mark(&mut chart, mark)?;
        }
        draw_mesh(&mut chart)?;
        for mark in self.marks.iter().filter(|mark| !matches!(mark, Mark::Span { .. })) {
            self.draw_mark(&mut chart, mark)?;
        }
        let (width, height) = surface.dim_in_pixel();
        write(surface, (units(4), units(3)), &self.y.label, INK, Pos::new(HPos::Left, VPos::Top))?;
        let corner = (whole(width) - units(18), whole(height) - units(5));
        write(surface, corner, &self.x.label, INK, Pos::new(HPos::Right, VPos::Bottom))
    }

    /// Where points stand in a drawing of the given size in figure units, in drawing units; points that are not finite have
    /// no place.
    ///
    /// # Errors
    ///
    /// The drawing library refuses the axes.
    pub(crate) fn positions(
        &self,
        (width, height): (i32, i32),
        points: &[Point],
    ) -> Result<Vec<Option<(i32, i32)>>, ReportError> {
        let mut unused = String::new();
        let surface = SVGBackend::with_string(&mut unused, (units(width) as u32, units(height) as u32));
        let surface = surface.into_drawing_area();
        let chart = self.chart(&surface)?;
        let place = |p: &Point| self.place(&[*p]).first().map(|at| chart.backend_coord(at));
        Ok(points.iter().map(place).collect())
    }

    fn chart<'a, 'b>(&self, surface: &'a Surface<'b>) -> Result<Chart<'a, 'b>, ReportError> {
        let (x_ticks, y_ticks) = (self.x.ticks(6), self.y.ticks(5));
        let longest = y_ticks.iter().map(|t| t.text.chars().count()).max().unwrap_or(1);
        ChartBuilder::on(surface)
            .margin_top(units(28))
            .margin_right(units(18))
            .x_label_area_size(units(46))
            .y_label_area_size(units(14 + whole(longest) * TEXT * 6 / 10))
            .build_cartesian_2d(Ticked::new(&self.x, x_ticks), Ticked::new(&self.y, y_ticks))
            .map_err(ReportError::drawing)
    }

    fn draw_mark(&self, chart: &mut Chart<'_, '_>, mark: &Mark) -> Result<(), ReportError> {
        match mark {
            Mark::Span { from, to, colour } => {
                self.bar(chart, (*from, *to), (self.y.lo, self.y.hi), colour.mix(1.0))
            }
            Mark::Band { points, colour, opacity } => self.band(chart, points, colour.mix(*opacity)),
            Mark::Line { points, colour, width } => {
                let style = stroke(*colour, *width);
                draw(chart, PathElement::new(self.place(points), style))
            }
            Mark::Dashes { points, colour } => {
                let (dash, gap) = (units(6), units(5));
                let dashes = DashedPathElement::new(self.place(points), dash, gap, stroke(*colour, 1.4));
                draw(chart, dashes)
            }
            Mark::Dots { points, colour, radius } => {
                let size = (radius * f64::from(SUBUNITS)).round() as i32;
                let dot = |at| Circle::new(at, size, colour.filled());
                self.place(points).into_iter().try_for_each(|at| draw(chart, dot(at)))
            }
            Mark::Stems { points, colour, width } => points.iter().try_for_each(|&(x, y)| {
                let stem = self.place(&[(x, 0.0), (x, y)]);
                draw(chart, PathElement::new(stem, stroke(*colour, *width)))
            }),
            Mark::Bars { bars, colour } => bars.iter().try_for_each(|&(left, right, top)| {
                self.bar(chart, (left, right), (self.y.lo, top), colour.mix(0.85))
            }),
            Mark::Heading { x, text, colour } => {
                let style = text_style(*colour, Pos::new(HPos::Left, VPos::Top));
                draw(chart, Text::new(format!("\u{a0}{text}"), (self.x.at(*x), self.y.ends().1), style))
            }
        }
    }

    /// A filled rectangle.
    fn bar(
        &self,
        chart: &mut Chart<'_, '_>,
        x: Point,
        y: Point,
        fill: impl Color,
    ) -> Result<(), ReportError> {
        let corners = [(self.x.at(x.0), self.y.at(y.0)), (self.x.at(x.1), self.y.at(y.1))];
        draw(chart, Rectangle::new(corners, fill.filled()))
    }

    fn band(
        &self,
        chart: &mut Chart<'_, '_>,
        points: &[(f64, f64, f64)],
        fill: impl Color,
    ) -> Result<(), ReportError> {
        let upper = points.iter().map(|p| (p.0, p.2));
        let lower = points.iter().rev().map(|p| (p.0, p.1));
        let outline = self.place(&upper.chain(lower).collect::<Vec<_>>());
        if outline.len() < 3 { Ok(()) } else { draw(chart, Polygon::new(outline, fill.filled())) }
    }

    /// Finite points on the axes' own scales, held inside the axes.
    fn place(&self, points: &[Point]) -> Vec<Point> {
        let finite = points.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
        finite
            .map(|p| (self.x.at(p.0.clamp(self.x.lo, self.x.hi)), self.y.at(p.1.clamp(self.y.lo, self.y.hi))))
            .collect()
    }
}

/// One SVG element of the given size in figure units, scaling with its container, with a name and a description.
///
/// # Errors
///
/// Whatever `paint` returns.
pub(crate) fn picture(
    (width, height): (i32, i32),
    title: &str,
    description: &str,
    paint: impl FnOnce(&Surface<'_>) -> Result<(), ReportError>,
) -> Result<String, ReportError> {
    let mut drawn = String::new();
    {
        let surface = SVGBackend::with_string(&mut drawn, (units(width) as u32, units(height) as u32));
        let surface = surface.into_drawing_area();
        paint(&surface)?;
        surface.present().map_err(ReportError::drawing)?;
    }
    let body = drawn.split_once('>').map_or("", |(_, body)| body);
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\" \
         stroke-linejoin=\"round\"><title>{}</title><desc>{}</desc>{}",
        units(width),
        units(height),
        escape(title),
        escape(title),
        escape(description),
        body.replace(">\n", ">").replace("\n</text>", "</text>")
    ))
}

/// Writes `text` at a place given in drawing units.
///
/// # Errors
///
/// The drawing library refuses the text.
pub(crate) fn write(
    surface: &Surface<'_>,
    at: (i32, i32),
    text: &str,
    colour: RGBColor,
    anchor: Pos,
) -> Result<(), ReportError> {
    surface.draw_text(text, &text_style(colour, anchor), at).map_err(ReportError::drawing)
}

/// Writes a title, vertically centred on a place given in drawing units.
///
/// # Errors
///
/// The drawing library refuses the text.
pub(crate) fn write_title(surface: &Surface<'_>, at: (i32, i32), text: &str) -> Result<(), ReportError> {
    let size = 1.24 * 1.3 * f64::from(units(TEXT));
    let font = (FONT, size, FontStyle::Bold).into_font();
    let style = font.color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
    surface.draw_text(text, &style, at).map_err(ReportError::drawing)
}

/// Figure units as drawing units.
pub(crate) fn units(size: i32) -> i32 {
    size * SUBUNITS
}

/// A count or a size as the signed number that places are made of.
pub(crate) fn whole(size: impl TryInto<i32>) -> i32 {
    size.try_into().unwrap_or(i32::MAX)
}

/// A stroke of a width in figure units.
pub(crate) fn stroke(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width((width * f64::from(SUBUNITS)).round() as u32)
}

fn draw_mesh(chart: &mut Chart<'_, '_>) -> Result<(), ReportError> {
    chart
        .configure_mesh()
        .disable_x_mesh()
        .bold_line_style(stroke(GRID, 1.0))
        .light_line_style(TRANSPARENT)
        .axis_style(stroke(MUTED, 1.0))
        .set_all_tick_mark_size(units(4))
        .label_style(text_style(MUTED, Pos::new(HPos::Center, VPos::Top)))
        .draw()
        .map_err(ReportError::drawing)
}

fn draw<'b, E>(chart: &mut Chart<'_, 'b>, element: E) -> Result<(), ReportError>
where
    for<'e> &'e E: plotters::element::PointCollection<'e, (f64, f64)>,
    E: plotters::element::Drawable<SVGBackend<'b>>,
{
    chart.draw_series(std::iter::once(element)).map(|_| ()).map_err(ReportError::drawing)
}

fn text_style(colour: RGBColor, anchor: Pos) -> TextStyle<'static> {
    // The drawing library divides the size of text by 1.24.
    let size = 1.24 * f64::from(units(TEXT));
    (FONT, size).into_font().color(&colour).pos(anchor)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
