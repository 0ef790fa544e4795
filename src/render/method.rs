//! Methods: an integrator with the values of all its parameters, resolved from a request and the scene file.

use super::JobError;
use crate::integrators::{self, Integrator, IntegratorSpec, Params, Renamed};
use crate::prepared::PreparedScene;
use crate::scene::diag::nearest;
use crate::scene::{Diagnostic, Diagnostics, SceneDesc, Severity};

/// Parameters that describe the picture, whichever integrator renders it: a scene's block for another integrator
/// still sets them.
const PICTURE_PARAMS: [&str; 2] = ["max_depth", "hide_emitters"];

/// The method that a user asks for; whatever is left open is taken from the scene file or from defaults.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MethodRequest {
    /// Name in tables; none: the integrator's.
    pub label: Option<String>,
    /// Integrator; none: the scene's.
    pub integrator: Option<String>,
    /// Largest number of edges of a path.
    pub max_depth: Option<i64>,
    /// Parameters by key, with their values as text.
    pub params: Vec<(String, String)>,
}

/// An integrator with the values of all its parameters.
#[derive(Clone)]
pub struct Method {
    /// Name in tables.
    pub label: String,
    /// Integrator.
    pub spec: &'static IntegratorSpec,
    /// Parameters.
    pub params: Params,
}

impl MethodRequest {
    /// Finds the integrator and sets its parameters: defaults first, then the scene file's block, then the request.
    ///
    /// # Errors
    /// If the integrator or a parameter of the request does not exist. Problems of the scene's block are diagnostics.
    pub fn resolve(&self, desc: &SceneDesc, diagnostics: &mut Diagnostics) -> Result<Method, JobError> {
        let spec = match &self.integrator {
            Some(name) => find_integrator(name)?,
            None => scene_integrator(desc, diagnostics)?,
        };
        let mut params = Params::defaults(spec);
        set_from_scene(&mut params, spec, desc, diagnostics);
        if let Some(depth) = self.max_depth {
            params.set("max_depth", &depth.to_string()).map_err(JobError::input)?;
        }
        for (key, value) in &self.params {
            let renamed = params.set(key, value).map_err(JobError::input)?;
            renamed.iter().for_each(|r| diagnostics.push(renamed_note(r)));
        }
        Ok(Method { label: self.label.clone().unwrap_or_else(|| spec.name.into()), spec, params })
    }

    /// The parameters of the request that have another name or word for the value now. None if the scene file names the
    /// integrator.
    ///
    /// # Errors
    /// If the integrator or a parameter does not exist.
    pub fn renamed(&self) -> Result<Vec<Renamed>, JobError> {
        let Some(name) = &self.integrator else { return Ok(vec![]) };
        let mut params = Params::defaults(find_integrator(name)?);
        let set = |(key, value): &(String, String)| params.set(key, value).transpose();
        self.params.iter().filter_map(set).collect::<Result<_, _>>().map_err(JobError::input)
    }
}

impl Method {
    /// A new integrator of this method.
    pub fn build(&self) -> Box<dyn Integrator> {
        (self.spec.build)(&self.params)
    }

    /// Parameters as text, in the order of declaration.
    pub fn parameters(&self) -> String {
        let pairs: Vec<String> = self.params.pairs().into_iter().map(|(k, v)| format!("{k}={v}")).collect();
        pairs.join(" ")
    }

    /// Light of the scene that the integrator leaves out, if there is any.
    pub fn limitation(&self, scene: &PreparedScene) -> Option<String> {
        (self.spec.limitations)(scene.features)
    }
}

/// The integrator of that name or alias.
///
/// # Errors
/// If there is none; the message names the nearest.
pub fn find_integrator(name: &str) -> Result<&'static IntegratorSpec, JobError> {
    integrators::find(name)
        .ok_or_else(|| JobError::Input(format!("unknown integrator \"{name}\"; {}", known_integrators(name))))
}

/// The integrator that the scene file names; `path` if it names none that is known here.
///
/// # Errors
/// If it makes another kind of picture and the scene was not forced to load.
fn scene_integrator(desc: &SceneDesc, diagnostics: &mut Diagnostics) -> Result<&'static IntegratorSpec, JobError> {
    let Some(block) = &desc.integrator else { return Ok(&integrators::path::SPEC) };
    if let Some(refused) = &block.refused {
        if refused.severity == Severity::Error {
            return Err(JobError::Input(format!("{}; name another one with -i", refused.line())));
        }
        diagnostics.push(refused.clone());
        return Ok(&integrators::path::SPEC);
    }
    Ok(integrators::find(&block.name).unwrap_or_else(|| {
        let message = format!("integrator \"{}\" is not known here; rendering with \"path\"", block.name);
        let warning = Diagnostic::warning("integrator::unknown", message);
        diagnostics.push(warning.at(block.span.clone()).label(known_integrators(&block.name)));
        &integrators::path::SPEC
    }))
}

/// Sets the parameters of the scene's block that apply to `spec`. Unusable values are reported and left out.
fn set_from_scene(params: &mut Params, spec: &IntegratorSpec, desc: &SceneDesc, diagnostics: &mut Diagnostics) {
    let Some(block) = &desc.integrator else { return };
    let other_integrator = integrators::find(&block.name).is_some_and(|s| s.name != spec.name);
    for (key, value, span) in &block.params {
        if other_integrator && !PICTURE_PARAMS.contains(&key.as_str()) {
            continue;
        }
        match params.set(key, value) {
            Ok(renamed) => renamed.iter().for_each(|r| diagnostics.push(renamed_note(r).at(span.clone()))),
            Err(e) => {
                diagnostics.push(Diagnostic::warning("integrator::parameter", e.to_string()).at(span.clone()));
            }
        }
    }
}

/// A parameter was given by an earlier name.
fn renamed_note(renamed: &Renamed) -> Diagnostic {
    Diagnostic::note("integrator::renamed", renamed.to_string())
}

/// Advice for an unknown name: the nearest known name, or all of them.
fn known_integrators(name: &str) -> String {
    let known = || integrators::REGISTRY.iter().map(|s| s.name);
    nearest(name, known()).map_or_else(
        || format!("known: {}", known().collect::<Vec<_>>().join(", ")),
        |n| format!("did you mean \"{n}\"?"),
    )
}
