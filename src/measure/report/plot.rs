//! A log-log plot as SVG.

use super::html::escape;
use std::fmt::Write;

/// A curve with what it varies in.
#[derive(Clone, Debug)]
pub struct Line {
    /// Name in the legend.
    pub name: String,
    /// x, y, smallest and largest y.
    pub points: Vec<[f64; 4]>,
}

/// A plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Name of the axes.
    pub axes: [String; 2],
    /// Curves.
    pub lines: Vec<Line>,
    /// A level below which nothing can be told, with its name.
    pub floor: Option<(String, f64)>,
}

/// Okabe & Ito's colours, which most colour-blind people can tell apart.
const COLOURS: [&str; 8] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c6d31"];
/// Dashes of the curves: where the colours begin anew, the next pattern is taken.
const DASHES: [&str; 3] = ["none", "7 4", "2 3"];

/// Colour and dashes of a curve.
#[derive(Clone, Copy)]
struct Stroke {
    colour: &'static str,
    dashes: &'static str,
}

impl Stroke {
    /// The stroke of curve `i`.
    fn of(i: usize) -> Stroke {
        Stroke { colour: COLOURS[i % COLOURS.len()], dashes: DASHES[i / COLOURS.len() % DASHES.len()] }
    }
}

const SIZE: [f64; 2] = [560.0, 380.0];
/// Left, top, right, bottom.
const MARGIN: [f64; 4] = [64.0, 30.0, 14.0, 44.0];
const LEGEND_LINE: f64 = 16.0;

/// A logarithmic axis between two values on the way from one coordinate to another.
struct Axis {
    lo: f64,
    hi: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Option<Axis> {
        let logs = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
        let (lo, hi) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        // A little air, and never an axis without length.
        let air = (0.04 * (hi - lo)).max(0.05);
        (lo <= hi).then_some(Axis { lo: lo - air, hi: hi + air, from, to })
    }

    fn at(&self, value: f64) -> f64 {
        let v = value.max(1e-300).log10().clamp(self.lo, self.hi);
        self.from + (v - self.lo) / (self.hi - self.lo) * (self.to - self.from)
    }

    /// Values to label: powers of ten, with twos and fives where there is room.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let fine = self.hi - self.lo < 2.5;
        let mut ticks = vec![];
        for decade in self.lo.floor() as i32..=self.hi.ceil() as i32 {
            for digit in 1..10 {
                let value = f64::from(digit) * 10f64.powi(decade);
                if (self.lo..=self.hi).contains(&value.log10()) {
                    ticks.push((value, digit == 1 || fine && (digit == 2 || digit == 5)));
                }
            }
        }
        ticks
    }
}

fn label(value: f64) -> String {
    if (1e-3..1e4).contains(&value) {
        let digits = (-value.log10().floor()).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.0e}")
    }
}

/// The rectangle of the curves in the picture, with its axes.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    base: f64,
    x: Axis,
    y: Axis,
}

impl Plot {
    /// The picture; a sentence where there is nothing to show.
    pub fn svg(&self) -> String {
        let [width, bottom] = SIZE;
        let Some(frame) = self.frame() else {
            return format!("<p>{}: nothing to plot</p>", escape(&self.title));
        };
        let height = bottom + LEGEND_LINE * (self.lines.len() + 1) as f64;
        let mut out = format!(
            "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
             aria-label=\"{0}\"><text class=\"title\" x=\"{1}\" y=\"18\">{0}</text>",
            escape(&self.title),
            frame.left,
        );
        frame.grid(&mut out);
        frame.outline(&mut out, &self.axes);
        for (i, line) in self.lines.iter().enumerate() {
            let stroke = Stroke::of(i);
            frame.curve(&mut out, line, stroke);
            let Stroke { colour, dashes } = stroke;
            let style = format!("stroke=\"{colour}\" stroke-dasharray=\"{dashes}\" stroke-width=\"2.5\"");
            frame.legend(&mut out, i, &style, &line.name);
        }
        if let Some((name, level)) = &self.floor {
            frame.legend(&mut out, self.lines.len(), "class=\"floor\"", &format!("{name}: {level:.2e}"));
            if level.log10() >= frame.y.lo {
                let Frame { left, right, .. } = frame;
                let _ = write!(out, "<path class=\"floor\" d=\"M{left} {0:.1}H{right}\"/>", frame.y.at(*level));
            }
        }
        out.push_str("</svg>");
        out
    }

    /// The frame for all points; none if no point can be shown.
    fn frame(&self) -> Option<Frame> {
        let all = || self.lines.iter().flat_map(|l| &l.points);
        let [width, bottom] = SIZE;
        let (left, right) = (MARGIN[0], width - MARGIN[2]);
        let (top, base) = (MARGIN[1], bottom - MARGIN[3]);
        let x = Axis::new(all().map(|p| p[0]), left, right)?;
        let y = Axis::new(all().flat_map(|p| p[1..].iter().copied()), base, top)?;
        Some(Frame { left, right, top, base, x, y })
    }
}

impl Frame {
    /// Lines and labels of both axes.
    fn grid(&self, out: &mut String) {
        let Frame { left, right, top, base, .. } = self;
        for (value, named) in self.x.ticks() {
            let at = self.x.at(value);
            let _ = write!(out, "<path class=\"grid\" d=\"M{at:.1} {top}V{base}\"/>");
            if named {
                let (below, label) = (base + 15.0, label(value));
                let _ = write!(out, "<text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"middle\">{label}</text>");
            }
        }
        for (value, named) in self.y.ticks() {
            let at = self.y.at(value);
            let _ = write!(out, "<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/>");
            if named {
                let (beside, line, label) = (left - 5.0, at + 4.0, label(value));
                let _ = write!(out, "<text x=\"{beside}\" y=\"{line:.1}\" text-anchor=\"end\">{label}</text>");
            }
        }
    }

    /// The outline with the names of the axes.
    fn outline(&self, out: &mut String, axes: &[String; 2]) {
        let Frame { left, right, top, base, .. } = self;
        let _ = write!(
            out,
            "<path class=\"frame\" d=\"M{left} {top}H{right}V{base}H{left}Z\"/>\
             <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            0.5 * (left + right),
            base + 32.0,
            escape(&axes[0]),
            0.5 * (top + base),
            escape(&axes[1]),
        );
    }

    /// Line `i` of the legend; `style` holds the attributes of its stroke.
    fn legend(&self, out: &mut String, i: usize, style: &str, name: &str) {
        let at = SIZE[1] + LEGEND_LINE * i as f64;
        let _ = write!(
            out,
            "<path {style} d=\"M{} {:.1}h22\"/><text x=\"{}\" y=\"{at:.1}\">{}</text>",
            self.left,
            at - 4.0,
            self.left + 28.0,
            escape(name)
        );
    }

    /// A curve with the band between its smallest and largest values.
    fn curve(&self, out: &mut String, line: &Line, stroke: Stroke) {
        let (Frame { x, y, .. }, Stroke { colour, dashes }) = (self, stroke);
        let place = |p: &[f64; 4], v: usize| format!("{:.1} {:.1}", x.at(p[0]), y.at(p[v]));
        let points: Vec<&[f64; 4]> = line.points.iter().filter(|p| p.iter().all(|v| v.is_finite())).collect();
        if points.is_empty() {
            return;
        }
        let upper: Vec<String> = points.iter().map(|p| place(p, 3)).collect();
        let lower: Vec<String> = points.iter().rev().map(|p| place(p, 2)).collect();
        let middle: Vec<String> = points.iter().map(|p| place(p, 1)).collect();
        let _ = write!(
            out,
            "<path d=\"M{}L{}Z\" fill=\"{colour}\" fill-opacity=\"0.15\"/>\
             <path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-dasharray=\"{dashes}\" stroke-width=\"2\"/>",
            upper.join("L"),
            lower.join("L"),
            middle.join("L")
        );
        for p in points {
            let _ = write!(
                out,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.8\" fill=\"{colour}\"><title>{}: {:.3} s, {:.4e} ({:.3e} to \
                 {:.3e})</title></circle>",
                x.at(p[0]),
                y.at(p[1]),
                escape(&line.name),
                p[0],
                p[1],
                p[2],
                p[3]
            );
        }
    }
}
