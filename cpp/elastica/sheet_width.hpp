#pragma once
/// Width along a sheet, piecewise linear. Example: the width of a square that is folded over its diagonal grows from
/// the held corner to the middle, and then decreases.

#include <cstddef>
#include <vector>

#include "elastica/sheet_slope.hpp"

namespace withe {

/// Width b(t) at a distance t from the tip [Lgb], relative to the width at which w is the weight per length. It equals
/// the weight per length over w, and the bending stiffness over 2 w Lgb^3. The width is constant beyond the last place.
class SheetWidth {
 public:
  SheetWidth() = default;  ///< 1 everywhere
  /// Widths at places that begin at 0 and grow.
  SheetWidth(const std::vector<double>& places, const std::vector<double>& widths);

  using Piece = WidthPiece<double>;

  bool even() const { return pieces_.empty(); }
  const std::vector<Piece>& pieces() const { return pieces_; }
  /// The last piece that begins before t; the first one where none does.
  std::size_t piece_before(double t) const;

  double width_at(double t) const { return even() ? 1.0 : pieces_[piece_before(t)].width_at(t); }
  /// Weight of the part from the tip to t [w Lgb].
  double weight_at(double t) const { return even() ? t : pieces_[piece_before(t)].weight_at(t); }

  /// 1 + share (scale b - 1): a way from an even sheet to this one.
  SheetWidth blended(double share, double scale) const;

 private:
  std::vector<Piece> pieces_;  // none of an even sheet
};

}  // namespace withe
