//! Properties of a material that hold at every point of a surface.

/// Properties of a material, known before any point is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Some parameter comes from a texture.
    pub textured: bool,
    /// Some lobe has discrete directions (mirrors, glass).
    pub delta: bool,
    /// Some lobe has a density, and is so narrow that connections hardly ever meet it.
    pub nearly_specular: bool,
    /// Some lobe has a density: connections and light samples can reach it.
    pub smooth: bool,
    /// Light crosses the surface and is refracted or passes a pane.
    pub transmissive: bool,
    /// Light may go straight on as if there were no surface (mask, null): there are points with holes.
    pub passes_through: bool,
    /// Some lobe changes the direction of light, or absorbs it.
    pub scatters: bool,
    /// Normals are tilted by a bump or normal map.
    pub tilted: bool,
    /// The back scatters light as well.
    pub two_sided: bool,
    /// The direction of ∂p/∂u matters: anisotropic roughness, bump and normal maps.
    pub oriented: bool,
}

impl Features {
    /// No light ever crosses the surface.
    pub fn opaque(&self) -> bool {
        !self.transmissive && !self.passes_through
    }

    /// Features of a surface without effect on light: masks' holes and null.
    pub(super) fn hole() -> Features {
        Features { passes_through: true, two_sided: true, ..Features::default() }
    }

    pub(super) fn union(self, o: Features) -> Features {
        Features {
            textured: self.textured || o.textured,
            delta: self.delta || o.delta,
            nearly_specular: self.nearly_specular || o.nearly_specular,
            smooth: self.smooth || o.smooth,
            transmissive: self.transmissive || o.transmissive,
            passes_through: self.passes_through || o.passes_through,
            scatters: self.scatters || o.scatters,
            tilted: self.tilted || o.tilted,
            two_sided: self.two_sided || o.two_sided,
            oriented: self.oriented || o.oriented,
        }
    }
}
