//! Rounding-error bounds of single precision arithmetic.

/// Half the spacing of floats around one: the relative error of one rounded operation.
pub const ROUND: f32 = f32::EPSILON * 0.5;

/// γ_n = n·u / (1 − n·u), the bound on the relative error of n rounded operations (Higham 2002, §3.1).
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * ROUND;
    nu / (1.0 - nu)
}

/// The largest float below one: random numbers are clamped to it so that they stay in [0, 1).
pub const ONE_MINUS_EPSILON: f32 = 1.0 - ROUND;
