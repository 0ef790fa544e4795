//! Wavefront MTL: materials of OBJ files. A line with a mistake costs that line only; the crate `tobj` gives up the
//! whole library at the first one (and panics on `Kd 0.5`), and leaves `Tf`, `Tr`, `map_Ke` and the options of textures
//! as text.

use super::mesh::MeshError;
use super::obj::for_each_line;
use crate::math::Rgb;
use std::io::BufRead;

/// A texture statement: file, and the factors that its options give.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub file: String,
    /// `-s u v`.
    pub scale: [f32; 2],
    /// `-o u v`.
    pub offset: [f32; 2],
    pub clamp: bool,
    /// `-bm`: multiplies heights.
    pub bump_multiplier: f32,
}

/// A material as the file has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mtl {
    pub name: String,
    pub line: u64,
    pub diffuse: Option<Rgb>,
    pub specular: Option<Rgb>,
    pub emission: Option<Rgb>,
    pub transmission: Option<Rgb>,
    /// Phong exponent.
    pub shininess: Option<f32>,
    pub ior: Option<f32>,
    /// `d`: one is opaque.
    pub dissolve: Option<f32>,
    /// `Tr`, an extension: zero is opaque.
    pub transparency: Option<f32>,
    pub illumination: Option<u32>,
    pub map_diffuse: Option<Map>,
    pub map_specular: Option<Map>,
    pub map_emission: Option<Map>,
    pub map_dissolve: Option<Map>,
    /// Heights (in the units of the model).
    pub map_bump: Option<Map>,
    /// Normals in tangent space, an extension.
    pub map_normal: Option<Map>,
}

impl Mtl {
    /// One is opaque. `d` is in the format; `Tr` is not, and exporters that write both disagree on its direction: `d`
    /// wins.
    pub(super) fn opacity(&self) -> f32 {
        self.dissolve.or(self.transparency.map(|t| 1.0 - t)).unwrap_or(1.0)
    }
}

/// A line that was not understood.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Complaint {
    pub line: u64,
    pub message: String,
}

/// Parses an MTL stream; lines with mistakes are left out and complained of.
pub(super) fn parse(reader: impl BufRead) -> Result<(Vec<Mtl>, Vec<Complaint>), MeshError> {
    let (mut all, mut complaints): (Vec<Mtl>, Vec<Complaint>) = (Vec::new(), Vec::new());
    for_each_line(reader, |line, text| {
        let (keyword, rest) = text.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((text, ""));
        let rest = rest.trim();
        if keyword == "newmtl" {
            all.push(Mtl { name: rest.to_owned(), line, ..Mtl::default() });
        } else if !keyword.is_empty() {
            let result = match all.last_mut() {
                Some(mtl) => property(mtl, keyword, rest),
                None => Err("a property before the first `newmtl`".into()),
            };
            if let Err(message) = result {
                complaints.push(Complaint { line, message });
            }
        }
        Ok(())
    })?;
    Ok((all, complaints))
}

fn property(mtl: &mut Mtl, keyword: &str, rest: &str) -> Result<(), String> {
    match keyword {
        "Kd" => mtl.diffuse = Some(color(rest)?),
        "Ks" => mtl.specular = Some(color(rest)?),
        "Ke" => mtl.emission = Some(color(rest)?),
        "Tf" => mtl.transmission = Some(color(rest)?),
        "Ns" => mtl.shininess = Some(number(rest)?.max(0.0)),
        "Ni" => mtl.ior = Some(number(rest)?),
        "d" => mtl.dissolve = Some(number(rest.trim_start_matches("-halo"))?.clamp(0.0, 1.0)),
        "Tr" => mtl.transparency = Some(number(rest)?.clamp(0.0, 1.0)),
        "illum" => mtl.illumination = Some(rest.parse().map_err(|_| format!("`{rest}` is not an illumination model"))?),
        "map_Kd" => mtl.map_diffuse = Some(map(rest)?),
        "map_Ks" => mtl.map_specular = Some(map(rest)?),
        "map_Ke" => mtl.map_emission = Some(map(rest)?),
        "map_d" => mtl.map_dissolve = Some(map(rest)?),
        "map_Bump" | "map_bump" | "bump" => mtl.map_bump = Some(map(rest)?),
        "norm" | "map_Kn" => mtl.map_normal = Some(map(rest)?),
        // Ambient terms, and what newer exporters add without a common meaning.
        "Ka" | "Km" | "map_Ka" | "map_Ns" | "map_Tr" | "disp" | "decal" | "refl" | "sharpness" | "map_aat" | "Pr"
        | "Pm" | "Ps" | "Pc" | "Pcr" | "aniso" | "anisor" | "map_Pr" | "map_Pm" | "map_Ps" | "map_Ke_factor"
        | "map_refl" | "Kt" | "map_Disp" => {}
        other => return Err(format!("unknown property `{other}`")),
    }
    Ok(())
}

fn number(text: &str) -> Result<f32, String> {
    let word = text.split_ascii_whitespace().next().unwrap_or("");
    word.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| format!("`{word}` is not a number"))
}

/// `r g b`, or `r` for all three.
fn color(text: &str) -> Result<Rgb, String> {
    if text.starts_with("spectral") || text.starts_with("xyz") {
        return Err("spectral and XYZ colours are not supported".into());
    }
    let words: Vec<f32> = text.split_ascii_whitespace().map(number).collect::<Result<_, _>>()?;
    match *words.as_slice() {
        [v] => Ok(Rgb::grey(v)),
        [r, g, b, ..] => Ok(Rgb::new(r, g, b)),
        _ => Err("a colour has one or three numbers".into()),
    }
}

/// Options with their numbers, then the file's name, which may hold blanks.
fn map(text: &str) -> Result<Map, String> {
    let mut out = Map { file: String::new(), scale: [1.0; 2], offset: [0.0; 2], clamp: false, bump_multiplier: 1.0 };
    let mut rest = text.trim();
    while rest.starts_with('-') {
        let (option, after) =
            rest.split_once(|c: char| c.is_ascii_whitespace()).ok_or("a texture without a file name")?;
        rest = after.trim_start();
        // Up to so many numbers (or words) belong to the option.
        let (most, numeric) = match option {
            "-s" | "-o" | "-t" => (3, true),
            "-mm" => (2, true),
            "-bm" | "-boost" | "-texres" => (1, true),
            "-blendu" | "-blendv" | "-clamp" | "-cc" | "-imfchan" | "-type" | "-colorspace" => (1, false),
            other => return Err(format!("unknown option `{other}` of a texture")),
        };
        let mut values = Vec::new();
        for _ in 0..most {
            let Some((word, after)) = rest.split_once(|c: char| c.is_ascii_whitespace()) else { break };
            if numeric {
                let Ok(v) = number(word) else { break };
                values.push(v);
            } else if option == "-clamp" {
                out.clamp = word == "on";
            }
            rest = after.trim_start();
        }
        let pair =
            |default: f32| [values.first().copied().unwrap_or(default), values.get(1).copied().unwrap_or(default)];
        match option {
            "-s" => out.scale = pair(1.0),
            "-o" => out.offset = pair(0.0),
            "-bm" => out.bump_multiplier = pair(1.0)[0],
            _ => {}
        }
    }
    if rest.is_empty() {
        return Err("a texture without a file name".into());
    }
    out.file = rest.trim_matches('"').to_owned();
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_properties_maps_and_options() {
        let text = "# c\nnewmtl red wall\nKd 1 0.5 0\nNs 96\nTr 0.25\nillum 2\n\
            map_Kd -s 2 3 1 -clamp on tex tures\\a b.png\nnewmtl b\nKe 3\n";
        let (all, complaints) = parse(text.as_bytes()).unwrap();
        assert!(complaints.is_empty(), "{complaints:?}");
        assert_eq!((all[0].name.as_str(), all[0].line), ("red wall", 2));
        assert_eq!(all[0].diffuse, Some(Rgb::new(1.0, 0.5, 0.0)));
        assert_eq!((all[0].opacity(), all[1].opacity()), (0.75, 1.0));
        let map = all[0].map_diffuse.as_ref().unwrap();
        assert_eq!((map.file.as_str(), map.scale, map.clamp), ("tex tures\\a b.png", [2.0, 3.0], true));
        assert_eq!(all[1].emission, Some(Rgb::grey(3.0)));
    }

    #[test]
    fn reads_bump_and_normal_maps() {
        let (all, complaints) = parse("newmtl a\nmap_Bump -bm 0.25 a.png\nnorm b.png\n".as_bytes()).unwrap();
        assert!(complaints.is_empty(), "{complaints:?}");
        let (bump, normal) = (all[0].map_bump.as_ref().unwrap(), all[0].map_normal.as_ref().unwrap());
        assert_eq!((bump.file.as_str(), bump.bump_multiplier), ("a.png", 0.25));
        assert_eq!((normal.file.as_str(), normal.bump_multiplier), ("b.png", 1.0));
    }

    #[test]
    fn dissolve_wins_over_transparency() {
        let (all, _) = parse("newmtl a\nTr 1\nd 1\nnewmtl b\nd 0.75\nTr 0.5\n".as_bytes()).unwrap();
        assert_eq!((all[0].opacity(), all[1].opacity()), (1.0, 0.75));
    }

    #[test]
    fn complains_with_the_line_and_goes_on() {
        let (all, complaints) =
            parse("Kd 1 1 1\nnewmtl a\nKd 1 x 1\nbogus 1\nmap_Kd -s\nKs 0.5 0.5 0.5\n".as_bytes()).unwrap();
        assert_eq!(complaints.iter().map(|c| c.line).collect::<Vec<_>>(), [1, 3, 4, 5]);
        assert_eq!(all[0].specular, Some(Rgb::grey(0.5)));
    }
}
