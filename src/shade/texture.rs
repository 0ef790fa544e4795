//! Textures: colours and numbers that vary over a surface.
/// A texture.
pub struct Texture;
