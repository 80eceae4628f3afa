//! Colours of deviations: the same on paper and on the screen.
//!
//! Between stops the scale is linear in sRGB. A unit test holds the default palette's promise: two values at least 0.4 of
//! the scale apart differ by at least 20 in CIELAB (ΔE 1976) for normal and for colour-blind eyes.

/// An 8-bit sRGB colour.
pub type Rgb = [u8; 3];

/// A colour scale from -1 to +1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Palette {
    /// Readable for the colour-blind, and the default.
    #[default]
    BlueGreyOrange,
    /// Hard to read for colour-blind people: neighbouring values differ too little.
    Viridis,
    /// Hard to read for colour-blind people: values far apart look alike.
    Rainbow,
}

const BLUE_GREY_ORANGE: [Rgb; 9] = [
    [0x11, 0x29, 0x74],
    [0x39, 0x5A, 0x9E],
    [0x64, 0x9B, 0xD7],
    [0xB3, 0xCB, 0xEE],
    [0xD7, 0xD1, 0xCA],
    [0xF3, 0xBC, 0x97],
    [0xFB, 0x9E, 0x5D],
    [0xBC, 0x51, 0x0D],
    [0x8C, 0x00, 0x00],
];
const VIRIDIS: [Rgb; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2D, 0x7B],
    [0x3B, 0x52, 0x8B],
    [0x2C, 0x72, 0x8E],
    [0x21, 0x91, 0x8C],
    [0x28, 0xAE, 0x80],
    [0x5E, 0xC9, 0x62],
    [0xAD, 0xDC, 0x30],
    [0xFD, 0xE7, 0x25],
];
const RAINBOW: [Rgb; 5] =
    [[0x00, 0x00, 0xFF], [0x00, 0xFF, 0xFF], [0x00, 0xFF, 0x00], [0xFF, 0xFF, 0x00], [0xFF, 0x00, 0x00]];

impl Palette {
    /// The colour of a value on the scale from -1 to +1; beyond its ends, the end's colour.
    pub fn colour(self, value: f64) -> Rgb {
        let stops = self.stops();
        let place = (value.clamp(-1.0, 1.0) + 1.0) * 0.5 * (stops.len() - 1) as f64;
        // A value that is no number has no place on the scale; it takes the middle's colour rather than an end's.
        let place = if place.is_finite() { place } else { 0.5 * (stops.len() - 1) as f64 };
        let low = (place as usize).min(stops.len() - 2);
        let part = place - low as f64;
        let mix = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
        std::array::from_fn(|k| mix(stops[low][k], stops[low + 1][k]))
    }

    /// The stops, evenly spaced from -1 to +1.
    pub fn stops(self) -> &'static [Rgb] {
        match self {
            Palette::BlueGreyOrange => &BLUE_GREY_ORANGE,
            Palette::Viridis => &VIRIDIS,
            Palette::Rainbow => &RAINBOW,
        }
    }
}

/// A palette laid over a range of deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// From minus to plus this value, mm; above 0.
    pub range_mm: f64,
    /// Its colours.
    pub palette: Palette,
    /// In so many steps of one colour; 0 = without steps.
    pub bands: u8,
}

impl Scale {
    /// The colour of a deviation; beyond the range, the end's colour.
    pub fn colour(&self, deviation_mm: f64) -> Rgb {
        self.palette.colour(self.in_bands(deviation_mm / self.range_mm))
    }

    /// A value on the scale from -1 to +1, moved into the middle of its band; what is no number has none.
    pub fn in_bands(&self, value: f64) -> f64 {
        if self.bands == 0 || value.is_nan() {
            return value;
        }
        let bands = f64::from(self.bands);
        let band = ((value.clamp(-1.0, 1.0) + 1.0) * 0.5 * bands).floor().min(bands - 1.0);
        (band + 0.5) * 2.0 / bands - 1.0
    }

    /// The ticks of a legend from the upper end down, mm: nine, or the limits of the bands where these are as few.
    pub fn ticks_mm(&self) -> Vec<f64> {
        let steps = if (2..=10).contains(&self.bands) { self.bands } else { 8 };
        (0..=steps).map(|k| self.range_mm * (1.0 - 2.0 * f64::from(k) / f64::from(steps))).collect()
    }
}

#[cfg(test)]
pub(in crate::report) mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn bands_have_one_colour_each_and_ticks_at_their_limits() {
        let scale = Scale { range_mm: 2.0, palette: Palette::default(), bands: 4 };
        // The limits are -2, -1, 0, 1, 2; a limit belongs to the band above it, the upper end to the last one.
        let middles =
            [(-9.0, -1.5), (-2.0, -1.5), (-1.01, -1.5), (-1.0, -0.5), (0.0, 0.5), (0.99, 0.5), (2.0, 1.5), (9.0, 1.5)];
        for (value, middle) in middles {
            assert_eq!(scale.colour(value), Palette::default().colour(middle / 2.0), "{value}");
        }
        assert_eq!(scale.ticks_mm(), [2.0, 1.0, 0.0, -1.0, -2.0]);
        let plain = Scale { bands: 0, ..scale };
        assert_eq!(plain.colour(0.3), Palette::default().colour(0.15));
        assert_eq!(plain.ticks_mm().len(), 9);
        assert_eq!(scale.colour(f64::NAN), plain.colour(f64::NAN));
    }

    /// Machado, Oliveira, Fernandes 2009, severity 1, applied to linear RGB.
    pub(in crate::report) fn visions() -> [(&'static str, Matrix3<f64>); 4] {
        let protan =
            Matrix3::new(0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998);
        let deutan =
            Matrix3::new(0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881);
        let tritan =
            Matrix3::new(1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.303900);
        [("normal", Matrix3::identity()), ("protan", protan), ("deutan", deutan), ("tritan", tritan)]
    }

    fn xyz(colour: Rgb, vision: &Matrix3<f64>) -> Vector3<f64> {
        let linear = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let rgb = vision * Vector3::new(linear(colour[0]), linear(colour[1]), linear(colour[2]));
        let xyz_from_rgb = Matrix3::new(
            0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041,
        );
        xyz_from_rgb * rgb.map(|c| c.clamp(0.0, 1.0))
    }

    /// Relative luminance, 0 to 1.
    pub(in crate::report) fn luminance(colour: Rgb) -> f64 {
        xyz(colour, &Matrix3::identity()).y
    }

    pub(in crate::report) fn lab(colour: Rgb, vision: &Matrix3<f64>) -> Vector3<f64> {
        let xyz = xyz(colour, vision);
        let f = |t: f64| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 };
        let (x, y, z) = (f(xyz.x / 0.95047), f(xyz.y), f(xyz.z / 1.08883));
        Vector3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
    }

    fn floor(palette: Palette, vision: &Matrix3<f64>) -> f64 {
        let labs: Vec<_> = (0..=80).map(|k| lab(palette.colour(f64::from(k) / 40.0 - 1.0), vision)).collect();
        let mut least = f64::INFINITY;
        for a in 0..labs.len() {
            for b in a + 16..labs.len() {
                least = least.min((labs[a] - labs[b]).norm());
            }
        }
        least
    }

    #[test]
    fn values_far_apart_never_look_alike() {
        for (name, vision) in visions() {
            let floor = floor(Palette::BlueGreyOrange, &vision);
            assert!(floor >= 20.0, "{name}: {floor:.1}");
        }
        // What the menu warns of is true.
        assert!(visions().iter().any(|(_, vision)| floor(Palette::Viridis, vision) < 20.0));
        assert!(visions().iter().any(|(_, vision)| floor(Palette::Rainbow, vision) < 20.0));
    }

    #[test]
    fn stops_ends_and_odd_values() {
        let palette = Palette::default();
        assert_eq!(palette.colour(-1.0), [0x11, 0x29, 0x74]);
        assert_eq!(palette.colour(0.0), [0xD7, 0xD1, 0xCA]);
        assert_eq!(palette.colour(7.0), palette.colour(1.0));
        assert_eq!(palette.colour(f64::NAN), palette.colour(0.0));
    }
}
