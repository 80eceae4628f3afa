//! Units of files. Inside the program every length is mm.

/// Units a file may be in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LengthUnit {
    /// Millimetre.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Inch, 25.4 mm.
    Inch,
    /// Micrometre.
    Um,
}

impl LengthUnit {
    /// Millimetres in one of this unit.
    pub fn in_mm(self) -> f64 {
        match self {
            LengthUnit::Mm => 1.0,
            LengthUnit::Cm => 10.0,
            LengthUnit::M => 1000.0,
            LengthUnit::Inch => 25.4,
            LengthUnit::Um => 0.001,
        }
    }

    /// The word in plans.
    pub fn key(self) -> &'static str {
        match self {
            LengthUnit::Mm => "mm",
            LengthUnit::Cm => "cm",
            LengthUnit::M => "m",
            LengthUnit::Inch => "inch",
            LengthUnit::Um => "um",
        }
    }
}
