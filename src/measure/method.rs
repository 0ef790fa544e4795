//! Methods as text, an integrator with parameters in one word: `bdpt:heuristic=power,max_depth=6`.

use crate::render::MethodRequest;

/// Reads a list of methods: names, each with `:key=value` and further `,key=value`. The text names the method in
/// tables. A comma also stands inside of values (`techniques=all,-0:*`): a piece that begins with a letter and is no
/// `key=value` begins a new method, every other piece belongs to the method before it.
///
/// # Errors
/// The expected form, as text.
pub fn parse_methods(text: &str) -> Result<Vec<MethodRequest>, String> {
    let expected = |what: &str| format!("\"{what}\": expected NAME or NAME:key=value, separated by commas");
    let (mut methods, mut labels): (Vec<MethodRequest>, Vec<String>) = (vec![], vec![]);
    for piece in text.split(',') {
        let key_value = |text: &str| text.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()));
        let word = piece.starts_with(|c: char| c.is_ascii_alphabetic());
        let before_colon = piece.split(':').next().unwrap_or_default();
        if word && !before_colon.contains('=') {
            let (name, first) = piece.split_once(':').map_or((piece, None), |(n, p)| (n, Some(p)));
            let params = match first {
                Some(p) => vec![key_value(p).ok_or_else(|| expected(piece))?],
                None => vec![],
            };
            methods.push(MethodRequest { integrator: Some(name.to_owned()), params, ..MethodRequest::default() });
            labels.push(piece.to_owned());
            continue;
        }
        let (method, label) = methods.last_mut().zip(labels.last_mut()).ok_or_else(|| expected(piece))?;
        match (word, key_value(piece), method.params.last_mut()) {
            (true, Some(pair), _) => method.params.push(pair),
            (false, _, Some((_, value))) if !piece.is_empty() => {
                value.push(',');
                value.push_str(piece);
            }
            _ => return Err(expected(piece)),
        }
        label.push(',');
        label.push_str(piece);
    }
    for (method, label) in methods.iter_mut().zip(&labels) {
        method.label = Some(label.clone());
    }
    labels.sort_unstable();
    match labels.windows(2).find(|w| w[0] == w[1]) {
        Some(w) => Err(format!("{} is named twice", w[0])),
        None => Ok(methods),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_separate_methods_parameters_and_parts_of_values() {
        let found = parse_methods("path,bdpt:techniques=all,-0:*,+2:3,max_depth=6,light").unwrap();
        let labels: Vec<&str> = found.iter().filter_map(|m| m.label.as_deref()).collect();
        assert_eq!(labels, ["path", "bdpt:techniques=all,-0:*,+2:3,max_depth=6", "light"]);
        let pair = |k: &str, v: &str| (k.to_owned(), v.to_owned());
        assert_eq!(found[1].integrator.as_deref(), Some("bdpt"));
        assert_eq!(found[1].params, [pair("techniques", "all,-0:*,+2:3"), pair("max_depth", "6")]);
        assert!(found[0].params.is_empty() && found[2].params.is_empty());
    }

    #[test]
    fn slips_are_explained() {
        for bad in ["", "-0:*", "path,", "path:max_depth", "a=b", "path,-1", "path,path"] {
            assert!(parse_methods(bad).is_err(), "{bad}");
        }
    }
}
