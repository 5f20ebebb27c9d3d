//! Colours that colour-blind readers tell apart: M. Okabe, K. Ito, "Color Universal Design", 2008.

/// Red, green, blue.
pub type Colour = (u8, u8, u8);

/// Colours in the order in which lines take them. Yellow, which is faint on white, comes last.
pub const PALETTE: [Colour; 8] = [
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (230, 159, 0),
    (204, 121, 167),
    (86, 180, 233),
    (0, 0, 0),
    (240, 228, 66),
];
