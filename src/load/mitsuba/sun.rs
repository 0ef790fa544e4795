//! Where the sun stands: the PSA algorithm (Blanco-Muriel et al. 2001, "Computing the solar vector", Solar Energy
//! 70(5)), good to half a minute of arc in the years 1999 – 2015.

use super::props::Props;
use glam::{DMat4, DVec3};

/// A place and a moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// Degrees north and east.
    latitude: f64,
    longitude: f64,
    /// Hours ahead of universal time.
    timezone: f64,
    year: i64,
    month: i64,
    day: i64,
    /// Local time.
    hour: f64,
    minute: f64,
    second: f64,
}

/// The defaults are Mitsuba's: Tokyo, 10 July 2010, three o'clock.
const DEFAULT: Moment = Moment {
    latitude: 35.6894,
    longitude: 139.6917,
    timezone: 9.0,
    year: 2010,
    month: 7,
    day: 10,
    hour: 15.0,
    minute: 0.0,
    second: 0.0,
};

/// Reads place and moment from a plugin's properties.
pub(super) fn when_and_where(p: &Props<'_>) -> Moment {
    Moment {
        latitude: p.float_or("latitude", DEFAULT.latitude),
        longitude: p.float_or("longitude", DEFAULT.longitude),
        timezone: p.float_or("timezone", DEFAULT.timezone),
        year: p.integer("year").unwrap_or(DEFAULT.year).clamp(-9999, 9999),
        month: p.integer("month").unwrap_or(DEFAULT.month).clamp(1, 12),
        day: p.integer("day").unwrap_or(DEFAULT.day).clamp(1, 31),
        hour: p.float_or("hour", DEFAULT.hour),
        minute: p.float_or("minute", DEFAULT.minute),
        second: p.float_or("second", DEFAULT.second),
    }
}

/// Light space (+z up) → the y-up space of version 0.6.
pub(super) fn y_up() -> DMat4 {
    DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2)
}

/// A direction in the y-up space of version 0.6 in light space.
pub(super) fn from_y_up(d: DVec3) -> DVec3 {
    DVec3::new(d.x, -d.z, d.y)
}

/// Unit vector to the sun in light space. Mitsuba 3 has x to the south and y to the west, 0.6 x to the east and z (in
/// its y-up space) to the south.
pub(super) fn direction(m: &Moment, legacy: bool) -> DVec3 {
    let (zenith, azimuth) = zenith_and_azimuth(m);
    let ((sin_z, cos_z), (sin_a, cos_a)) = (zenith.sin_cos(), azimuth.sin_cos());
    if legacy {
        from_y_up(DVec3::new(sin_a * sin_z, cos_z, -cos_a * sin_z))
    } else {
        DVec3::new(-cos_a * sin_z, -sin_a * sin_z, cos_z)
    }
}

/// Angle from the zenith, and from north towards east.
fn zenith_and_azimuth(m: &Moment) -> (f64, f64) {
    let hours = m.hour - m.timezone + (m.minute + m.second / 60.0) / 60.0;
    // Days since noon of 1 January 2000.
    let shift = (m.month - 14) / 12;
    let julian = (1461 * (m.year + 4800 + shift)) / 4 + (367 * (m.month - 2 - 12 * shift)) / 12
        - (3 * ((m.year + 4900 + shift) / 100)) / 4
        + m.day
        - 32075;
    let days = julian as f64 - 0.5 + hours / 24.0 - 2_451_545.0;

    let omega = 2.1429 - 0.001_039_459_4 * days;
    let mean_longitude = 4.895_063_0 + 0.017_202_791_698 * days;
    let anomaly = 6.240_060_0 + 0.017_201_969_9 * days;
    let longitude = mean_longitude + 0.033_416_07 * anomaly.sin() + 0.000_348_94 * (2.0 * anomaly).sin()
        - 0.000_113_4
        - 0.000_020_3 * omega.sin();
    let obliquity = 0.409_092_8 - 6.214_0e-9 * days + 0.000_039_6 * omega.cos();

    let right_ascension = (obliquity.cos() * longitude.sin()).atan2(longitude.cos());
    let declination = (obliquity.sin() * longitude.sin()).asin();
    let sidereal = (6.697_424_324_2 + 0.065_709_828_3 * days + hours) * 15.0 + m.longitude;
    let hour_angle = sidereal.to_radians() - right_ascension;
    let latitude = m.latitude.to_radians();
    let zenith = (latitude.cos() * hour_angle.cos() * declination.cos() + declination.sin() * latitude.sin())
        .clamp(-1.0, 1.0)
        .acos();
    let azimuth = (-hour_angle.sin()).atan2(declination.tan() * latitude.cos() - latitude.sin() * hour_angle.cos());
    // Seen from the surface, not the centre, of the earth: mean radius over the astronomical unit, in km.
    (zenith + 6371.01 / 149_597_890.0 * zenith.sin(), azimuth)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mitsuba 3.9.1, scalar_rgb: `sun_direction` of a `sunsky` with all defaults.
    #[test]
    fn default_is_mitsubas() {
        let d = direction(&DEFAULT, false);
        assert!((d - DVec3::new(0.051_385_4, 0.691_748, 0.720_308)).length() < 2e-5, "{d}");
    }

    #[test]
    fn old_and_new_light_space_agree_in_height() {
        let (old, new) = (direction(&DEFAULT, true), direction(&DEFAULT, false));
        assert!((old.z - new.z).abs() < 1e-12 && (old.length() - 1.0).abs() < 1e-12);
        assert!((y_up().transform_vector3(old).y - new.z).abs() < 1e-12);
    }
}
