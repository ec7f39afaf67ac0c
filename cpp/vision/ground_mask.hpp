#pragma once
/// Mask of cables that lie on a ground with shadows, by brightness and chromaticity relative to the ground.

#include <cstdint>

#include "vision/color_image.hpp"

namespace withe {

/// One byte per pixel: 1 if the pixel differs from the ground beneath by more than a shadow can.
///
/// The logarithms of the three channels are compared with a quadratic surface, which is fitted to the ground by
/// iteratively reweighted least squares. A shadow lowers all three logarithms alike, and by no more than a limit. A
/// pixel counts if its chromaticity differs, if it is brighter than the ground, or if it is darker than the limit. A
/// darker region within the limit counts if it does not lie beside such pixels, where a shadow would lie.
/// Thresholds follow the spread of the ground. Pixels of weak evidence count where they touch strong ones, and edges
/// lie where the evidence is half of the evidence nearby. Lines that are much thinner than the cables are removed.
///
/// On ground so dark that shadows are below `contrast`, `foreground_mask` gives the mask.
///
/// `contrast` is the least difference of a cable from the ground [grey levels].
void ground_mask(const ColorImage& image, int contrast, std::uint8_t* mask);

/// True if the ground is so dark that its shadows are below `contrast`.
bool has_dark_ground(const ColorImage& image, int contrast);

}  // namespace withe
