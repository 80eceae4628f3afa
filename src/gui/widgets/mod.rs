//! What the screens are drawn with: signs of verdicts, words in a place, buttons for gloves, lamps, bars.

pub mod buttons;
pub mod cards;
pub mod sign;
pub mod words;
