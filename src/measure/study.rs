//! A study of convergence: methods, scenes, runs and speed-ups, as tables and as a page.

use super::converge::Run;
use super::curve::{MEASURES, Measure, SpeedUp, mean_curve, runs_of, speed_ups};
use super::machine::{Load, Machine};
use super::reference::{OwnError, Reference, ReferenceFacts};
use super::report::{Line, Page, Plot, Shown, Table, picture_group};
use crate::render::Method;
use serde::Serialize;

/// A method as the study shows it.
#[derive(Clone, Debug, Serialize)]
pub struct MethodSummary {
    /// Name in tables.
    pub label: String,
    /// Integrator.
    pub integrator: &'static str,
    /// All its parameters.
    pub parameters: String,
    /// Its expectation is the rendering equation's solution.
    pub unbiased: bool,
}

impl From<&Method> for MethodSummary {
    fn from(method: &Method) -> MethodSummary {
        MethodSummary {
            label: method.label.clone(),
            integrator: method.spec.name,
            parameters: method.parameters(),
            unbiased: method.spec.unbiased,
        }
    }
}

/// Convergence on one scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneStudy {
    /// Name.
    pub scene: String,
    /// File.
    pub file: String,
    /// Width and height.
    pub size: [u32; 2],
    /// Triangles.
    pub triangles: usize,
    /// Facts about the reference.
    pub reference: ReferenceFacts,
    /// Methods.
    pub methods: Vec<MethodSummary>,
    /// All points of all runs.
    pub runs: Vec<Run>,
    /// Speed-ups over the baseline.
    pub speed_ups: Vec<SpeedUp>,
    /// Load of the machine by other programs.
    pub load: Load,
}

/// Convergence on several scenes. The keys are a contract.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Command line.
    pub command: String,
    /// Seconds that every method had with every seed.
    pub seconds: f64,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// Label of the method that others are compared with.
    pub baseline: String,
    /// Machine.
    pub machine: Machine,
    /// Scenes.
    pub scenes: Vec<SceneStudy>,
}

impl SceneStudy {
    /// Speed-ups of all methods in every measure, or in the one that a target was given for.
    pub fn answer(&mut self, baseline: &str, target: Option<(Measure, f64)>) {
        let labels: Vec<String> = self.methods.iter().map(|m| m.label.clone()).collect();
        let measures = MEASURES.into_iter().filter(|m| target.is_none_or(|(t, _)| t.key == m.key));
        let of = |m| speed_ups(&self.runs, &labels, baseline, m, target.map(|t| t.1));
        self.speed_ups = measures.flat_map(of).collect();
    }

    /// Methods whose render time was enough for one sample per pixel only.
    pub fn single_samples(&self) -> Vec<&str> {
        let single = |m: &&MethodSummary| {
            let runs = runs_of(&self.runs, &m.label);
            !runs.is_empty() && runs.iter().all(|r| r.points.last().is_some_and(|p| p.iterations == 1))
        };
        self.methods.iter().filter(single).map(|m| m.label.as_str()).collect()
    }

    /// Errors of every method at the end: means over seeds, and half of the spread.
    pub fn end_table(&self) -> Table {
        let head = ["method", "samples", "seconds", "Mrays/s"].map(String::from).to_vec();
        let names = MEASURES.iter().map(|m| m.name.to_owned());
        let mut table = Table::new(head.into_iter().chain(names).chain(["mean ratio".into(), "non-finite".into()]));
        for method in &self.methods {
            let runs = runs_of(&self.runs, &method.label);
            let Some(end) = mean_curve(&runs, MEASURES[0]).last().copied() else { continue };
            let ends = || runs.iter().filter_map(|r| r.points.last());
            let seconds: f64 = ends().map(|p| p.seconds).sum();
            let rays: u64 = runs.iter().map(|r| r.rays).sum();
            let mut row = vec![
                method.label.clone(),
                format!("{:.0}", end.iterations),
                format!("{:.2}", end.seconds),
                format!("{:.2}", rays as f64 / seconds / 1e6),
            ];
            for measure in MEASURES {
                if let Some(s) = mean_curve(&runs, measure).last() {
                    let half = 50.0 * (s.high - s.low) / s.error;
                    row.push(format!("{:.3e} ±{half:.0} %", s.error));
                }
            }
            row.push(format!("{:.4}", ends().map(|p| p.mean_ratio).sum::<f64>() / runs.len() as f64));
            row.push(runs.iter().map(|r| r.non_finite).sum::<u64>().to_string());
            table.row(row);
        }
        table
    }

    /// Times to reach an error and speed-ups, one row for each method and measure.
    pub fn speed_table(&self) -> Table {
        let mut table = Table::new(["method", "measure", "error", "seconds", "baseline", "speed-up", "over seeds"]);
        let seconds = |s: Option<f64>| s.map_or("not reached".into(), |s| format!("{s:.2}"));
        for s in &self.speed_ups {
            table.row([
                s.method.clone(),
                s.measure.to_owned(),
                format!("{:.3e}", s.target),
                seconds(s.seconds),
                seconds(s.baseline_seconds),
                s.ratio.map_or("–".into(), |r| format!("{r:.2}")),
                s.spread.map_or("–".into(), |[a, b]| format!("{a:.2} … {b:.2}")),
            ]);
        }
        table
    }

    fn plots(&self) -> String {
        let floor = |measure: &Measure| {
            let own: OwnError = self.reference.own?;
            let level = match measure.key {
                "relmse" | "relmse_trimmed" => own.relmse,
                "mape" => own.mape,
                "l1" => own.mae,
                _ => return None,
            };
            Some(("error of the reference (estimate)".to_owned(), level))
        };
        let line = |method: &MethodSummary, measure: Measure| Line {
            name: method.label.clone(),
            points: mean_curve(&runs_of(&self.runs, &method.label), measure)
                .iter()
                .map(|s| [s.seconds, s.error, s.low, s.high])
                .collect(),
        };
        let plot = |measure: Measure| Plot {
            title: format!("{}: {} against time", self.scene, measure.name),
            axes: ["render seconds".into(), measure.name.into()],
            lines: self.methods.iter().map(|m| line(m, measure)).collect(),
            floor: floor(&measure),
        };
        MEASURES.into_iter().map(|m| plot(m).svg()).collect()
    }

    /// The scene's part of a page.
    pub fn show(&self, page: &mut Page, reference: &Reference) {
        page.heading(2, &self.scene);
        let [width, height] = self.size;
        page.text(&format!(
            "{}: {width} x {height} pixels, {} triangles; {}.",
            self.file,
            self.triangles,
            self.load.sentence()
        ));
        page.text(&format!("{}.", self.reference.sentence()));
        let of_method = |method: &MethodSummary| runs_of(&self.runs, &method.label).into_iter().next();
        let mut shown: Vec<Shown> = self
            .methods
            .iter()
            .filter_map(|m| {
                let run = of_method(m)?;
                let end = run.points.last()?;
                let note = format!("{} samples, relMSE {:.2e}", end.iterations, end.relmse);
                Some(Shown { name: m.label.clone(), pixels: &run.picture, note })
            })
            .collect();
        shown.push(Shown { name: "reference".into(), pixels: &reference.pixels, note: String::new() });
        page.heading(3, "After equal time (first seed)");
        page.markup(&picture_group(self.size, &shown, Some(&reference.pixels)));
        page.heading(3, "Error against time");
        page.markup(&self.plots());
        page.heading(3, "At the end (mean over seeds, half of the spread)");
        page.table(&self.end_table());
        page.heading(3, "Time to reach an error");
        page.table(&self.speed_table());
    }
}

impl Study {
    /// Speed-ups of every method on every scene in one measure, with the geometric mean over scenes.
    pub fn summary(&self) -> Table {
        let measure = self.scenes.iter().flat_map(|s| &s.speed_ups).map(|s| s.measure).next().unwrap_or("relmse");
        let mut methods: Vec<&str> = vec![];
        for m in self.scenes.iter().flat_map(|s| &s.methods) {
            if !methods.contains(&m.label.as_str()) {
                methods.push(&m.label);
            }
        }
        let head = std::iter::once(format!("speed-up over {} ({measure})", self.baseline));
        let mut table = Table::new(head.chain(methods.iter().map(|m| (*m).to_owned())));
        let ratio = |scene: &SceneStudy, method: &str| {
            scene.speed_ups.iter().find(|s| s.measure == measure && s.method == method).and_then(|s| s.ratio)
        };
        let cell = |r: Option<f64>| r.map_or("–".into(), |r| format!("{r:.2}"));
        for scene in &self.scenes {
            table.row(std::iter::once(scene.scene.clone()).chain(methods.iter().map(|m| cell(ratio(scene, m)))));
        }
        let mean = |method: &&str| {
            let all: Option<Vec<f64>> = self.scenes.iter().map(|s| ratio(s, method).map(f64::ln)).collect();
            cell(all.map(|v| (v.iter().sum::<f64>() / v.len() as f64).exp()))
        };
        if self.scenes.len() > 1 {
            table.row(std::iter::once("geometric mean".to_owned()).chain(methods.iter().map(mean)));
        }
        table
    }

    /// The page; the references are those of the scenes, in their order.
    pub fn page(&self, references: &[Reference]) -> String {
        let names: Vec<&str> = self.scenes.iter().map(|s| s.scene.as_str()).collect();
        let mut page = Page::new(&format!("Convergence: {}", names.join(", ")));
        page.command(&self.command);
        page.text(&format!(
            "Every method had {} seconds for each of {} seeds ({:?}), in turns with the others. Times are wall \
             seconds of iterations, everything included but loading the scene and taking errors.",
            self.seconds,
            self.seeds.len(),
            self.seeds
        ));
        page.text(
            "d is the difference from the reference r: relMSE is the mean of d²/(r² + 0.01) (trimmed: without the \
             worst 0.1 % of the pixels), MAPE of |d|/(r + 0.01), L1 of |d|, over pixels and channels; FLIP is \
             LDR-FLIP of the pictures clipped to [0, 1]. A speed-up is the baseline's time to reach an error over \
             the method's; where no error was asked for it is the smallest that both reach.",
        );
        page.table(&self.machine.table());
        page.table(&self.methods_table());
        page.table(&self.summary());
        for (scene, reference) in self.scenes.iter().zip(references) {
            scene.show(&mut page, reference);
        }
        page.finish()
    }

    fn methods_table(&self) -> Table {
        let mut table = Table::new(["method", "integrator", "parameters", "unbiased"]);
        for m in self.scenes.iter().flat_map(|s| &s.methods) {
            let row = [m.label.as_str(), m.integrator, &m.parameters, if m.unbiased { "yes" } else { "no" }];
            if !table.rows.iter().any(|r| r[..] == row) {
                table.row(row);
            }
        }
        table
    }
}
