//! Edges inside of flat regions: those along which a triangle goes on in its own plane, as the diagonal of a square. No
//! other surface is joined there, and hit points need not keep off them.

use crate::math::DVec3;
use crate::ray::MeshBuffers;
use rayon::prelude::*;
use std::collections::HashMap;

/// Cosine of the angle between neighbours in one plane at least: a thousandth of a radian.
const MIN_COSINE: f64 = 1.0 - 5e-7;
/// Meshes with more triangles have no flat edges: the search would take longer than a tenth of a second, and a few points
/// more that are moved by some error bounds change nothing in meshes of small triangles.
const MAX_TRIANGLES: usize = 1 << 17;

/// Bit `i` of an entry: the edge of the triangle opposite to corner `i` is inside of a flat region.
pub(super) fn flat_edges(buffers: &MeshBuffers) -> Vec<u8> {
    let triangles = &buffers.triangles;
    let mut flat = vec![0u8; triangles.len()];
    if triangles.len() < 2 || triangles.len() > MAX_TRIANGLES {
        return flat;
    }
    let vertices = vertices_by_place(buffers);
    let mut edges: Vec<Edge> = (0..triangles.len() as u32)
        .flat_map(|t| (0..3).map(move |i| (t, i)))
        .map(|(t, i)| {
            let [a, b] = ends(&triangles[t as usize], i).map(|v| vertices[v as usize]);
            Edge { ends: [a.min(b), a.max(b)], triangle: t, opposite: i }
        })
        .collect();
    edges.par_sort_unstable();
    // Vertices at which a region ends.
    let mut is_border = vec![false; vertices.len()];
    for same in edges.chunk_by(|a, b| a.ends == b.ends) {
        match same {
            [a, b] if goes_on(buffers, a, b) => same.iter().for_each(|e| flat[e.triangle as usize] |= 1 << e.opposite),
            _ => same[0].ends.iter().for_each(|&v| is_border[v as usize] = true),
        }
    }
    // A corner on the border of a region is kept off by the triangle's edges alone: both must not be flat.
    for (flat, t) in flat.iter_mut().zip(triangles) {
        for (i, &v) in t.iter().enumerate() {
            let beside = 0b111 & !(1 << i);
            if is_border[vertices[v as usize] as usize] && *flat & beside == beside {
                *flat &= !beside;
            }
        }
    }
    flat
}

/// An edge of a triangle, known by the places of its ends.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// Vertices in ascending order, by [`vertices_by_place`].
    ends: [u32; 2],
    triangle: u32,
    /// Corner of the triangle that is not on the edge.
    opposite: u32,
}

/// The vertices of a triangle's edge opposite to corner `i`.
fn ends(triangle: &[u32; 3], i: u32) -> [u32; 2] {
    [triangle[(i as usize + 1) % 3], triangle[(i as usize + 2) % 3]]
}

/// For each vertex the number of the first one at its place.
fn vertices_by_place(buffers: &MeshBuffers) -> Vec<u32> {
    let mut first = HashMap::with_capacity(buffers.positions.len());
    let numbered = buffers.positions.iter().zip(0u32..);
    // Zero has two signs and is one place.
    numbered.map(|(p, i)| *first.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert(i)).collect()
}

/// The triangle of `b` continues that of `a` in its plane, on the other side of their edge.
fn goes_on(buffers: &MeshBuffers, a: &Edge, b: &Edge) -> bool {
    let place = |e: &Edge, corner: u32| buffers.corners(e.triangle)[corner as usize % 3].as_dvec3();
    let [start, end] = [place(a, a.opposite + 1), place(a, a.opposite + 2)];
    let normal = |apex: DVec3| (end - start).cross(apex - start).normalize_or_zero();
    normal(place(a, a.opposite)).dot(-normal(place(b, b.opposite))) > MIN_COSINE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::ray::{SurfaceMask, VertexBuffer};

    fn flat(corners: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
        let positions = VertexBuffer::new(corners.iter().map(|&c| Vec3::from(c)).collect());
        flat_edges(&MeshBuffers { surface: SurfaceMask::BLOCKERS, positions, triangles: triangles.to_vec() })
    }

    #[test]
    fn the_diagonal_of_a_square_is_flat() {
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(flat(&square, &[[0, 1, 2], [0, 2, 3]]), [0b010, 0b100]);
        // Wound the other way round, or with vertices of its own, the second half is where it was.
        assert_eq!(flat(&square, &[[0, 1, 2], [2, 0, 3]]), [0b010, 0b100]);
        let split = [&square[..], &[[-0.0, 0.0, 0.0], [1.0, 1.0, -0.0]]].concat();
        assert_eq!(flat(&split, &[[0, 1, 2], [4, 5, 3]]), [0b010, 0b100]);
        // Bent, folded, and with a third triangle on the diagonal.
        let bent = [square[0], square[1], square[2], [0.0, 1.0, 0.01]];
        assert_eq!(flat(&bent, &[[0, 1, 2], [0, 2, 3]]), [0, 0]);
        assert_eq!(flat(&[square[0], square[1], square[2], [0.9, 0.2, 0.0]], &[[0, 1, 2], [0, 2, 3]]), [0, 0]);
        let third = [&square[..], &[[0.0, 0.0, 1.0]]].concat();
        assert_eq!(flat(&third, &[[0, 1, 2], [0, 2, 3], [0, 2, 4]]), [0, 0, 0]);
    }

    /// In a fan of three triangles the middle one has a corner of the border between two inner edges.
    #[test]
    fn corners_on_the_border_have_an_edge_to_keep_off_from() {
        let fan = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
        assert_eq!(flat(&fan, &[[0, 1, 2], [0, 2, 3], [0, 3, 4]]), [0b010, 0, 0b100]);
    }
}
