//! `lightsieve list`: the integrators, and the parameters of one.

use super::Failure;
use super::cli::ListArgs;
use crate::integrators::params::AliasValues;
use crate::integrators::{IntegratorSpec, ParamDefault, ParamSpec, REGISTRY};
use crate::render::method::find_integrator;

/// Columns of full descriptions.
const WIDTH: usize = 90;

pub(crate) fn run(args: &ListArgs) -> Result<(), Failure> {
    let Some(name) = &args.integrator else {
        let width = REGISTRY.iter().map(|s| s.name.len()).max().unwrap_or(0);
        for spec in REGISTRY {
            out!("{:width$}  {}", spec.name, spec.short);
            if args.long {
                print_paragraphs(spec.long, 4);
                out!("");
            }
        }
        return Ok(());
    };
    let spec = find_integrator(name)?;
    out!("{}: {}\n", spec.name, spec.short);
    if args.long {
        print_descriptions(spec);
    } else {
        print_table(spec);
    }
    Ok(())
}

/// One row for each parameter; allowed words stand below each other.
fn print_table(spec: &IntegratorSpec) {
    let rows: Vec<(&ParamSpec, String, Vec<String>)> =
        spec.params().map(|p| (p, p.default_text(), allowed(p))).collect();
    let width = |head: &str, cells: &mut dyn Iterator<Item = &str>| {
        cells.map(|c| c.chars().count()).max().unwrap_or(0).max(head.len())
    };
    let name_width = width("PARAMETER", &mut rows.iter().map(|(p, ..)| p.name));
    let default_width = width("DEFAULT", &mut rows.iter().map(|(_, d, _)| d.as_str()));
    let values_width = width("VALUES", &mut rows.iter().flat_map(|(.., v)| v.iter().map(String::as_str)));
    let line = |cells: [&str; 4]| {
        let [name, default, values, text] = cells;
        let line = format!("  {name:name_width$}  {default:default_width$}  {values:values_width$}  {text}");
        out!("{}", line.trim_end());
    };
    line(["PARAMETER", "DEFAULT", "VALUES", "MEANING"]);
    for (p, default, values) in &rows {
        line([p.name, default, values.first().map_or("", String::as_str), p.short]);
        for more in values.iter().skip(1) {
            line(["", "", more, ""]);
        }
    }
    out!("\nFull descriptions: lightsieve list -i {} --long", spec.name);
}

/// Allowed values, short enough for a column.
fn allowed(p: &ParamSpec) -> Vec<String> {
    let range = |min: &dyn std::fmt::Display, max: &dyn std::fmt::Display| {
        format!("{min} … {max} {}", p.unit).trim_end().to_owned()
    };
    match p.default {
        ParamDefault::Int { min, max, .. } => vec![range(&min, &max)],
        ParamDefault::Float { min, max, .. } | ParamDefault::Fraction { min, max, .. } => vec![range(&min, &max)],
        ParamDefault::AutoInt { min, max } => vec!["auto".into(), range(&min, &max)],
        ParamDefault::AutoFraction { min, max } => vec!["auto".into(), range(&min, &max)],
        ParamDefault::Bool(_) => vec!["true".into(), "false".into()],
        ParamDefault::Choice { choices, .. } => choices.iter().map(|c| c.name.to_owned()).collect(),
        ParamDefault::Techniques(_) => vec!["list of s:t".into()],
    }
}

/// The integrator's description and those of all parameters.
fn print_descriptions(spec: &IntegratorSpec) {
    print_paragraphs(spec.long, 0);
    for p in spec.params() {
        out!("\n{} (default {})", p.name, p.default_text());
        print_paragraphs(p.short, 4);
        if let ParamDefault::Choice { choices, .. } = p.default {
            for c in choices {
                out!("");
                print_paragraphs(&format!("{}: {}", c.name, c.meaning), 8);
            }
        } else {
            print_paragraphs(&format!("Values: {}", p.values()), 4);
        }
        out!("");
        print_paragraphs(p.long, 4);
        for alias in p.aliases {
            let values = match alias.values {
                AliasValues::Same => String::new(),
                AliasValues::Parts(100) => " in percent".into(),
                AliasValues::Parts(parts) => format!(" in units of 1/{parts}"),
                AliasValues::ZeroIsAuto => " with 0 for auto".into(),
            };
            out!("    Earlier name: {}{values}", alias.name);
        }
    }
}

fn print_paragraphs(text: &str, indent: usize) {
    for (i, paragraph) in text.split("\n\n").enumerate() {
        if i > 0 {
            out!("");
        }
        for line in wrapped(paragraph, WIDTH - indent) {
            out!("{:indent$}{line}", "");
        }
    }
}

/// Breaks a paragraph into lines of at most `width` characters; longer words stand alone.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paragraphs_are_broken_between_words() {
        assert_eq!(wrapped("one two  three", 7), ["one two", "three"]);
        assert_eq!(wrapped("ü ü ü ü", 3), ["ü ü", "ü ü"]);
        assert_eq!(wrapped("immeasurable", 3), ["immeasurable"]);
        assert!(wrapped(" ", 3).is_empty());
    }
}
