#pragma once
/// Width of a sheet along it, in straight pieces: that of a square folded over its diagonal grows from the corner that
/// is held to the middle, and falls again.

#include <cstddef>
#include <vector>

namespace withe {

/// b(t), t the distance from the tip [Lgb], relative to the width at which w is the sheet's weight per length; so b is
/// also its weight per length, in w, and its bending stiffness, over 2 w Lgb^3. Beyond the last place b is as there.
class SheetWidth {
 public:
  SheetWidth() = default;  ///< 1 everywhere
  /// Widths at places that begin at 0 and grow.
  SheetWidth(const std::vector<double>& places, const std::vector<double>& widths);

  /// From a place on: b = width + slope (t - begin); `weight` is that of all before it, from the tip on.
  struct Piece {
    double begin = 0, width = 1, slope = 0, weight = 0;

    template <class Scalar>
    Scalar width_at(const Scalar& t) const {
      return width + slope * (t - begin);
    }
    template <class Scalar>
    Scalar weight_at(const Scalar& t) const {
      return weight + (t - begin) * (width + (0.5 * slope) * (t - begin));
    }
  };

  bool even() const { return pieces_.empty(); }
  const std::vector<Piece>& pieces() const { return pieces_; }
  /// The last piece that begins before t; the first one where none does.
  std::size_t piece_before(double t) const;

  double width_at(double t) const { return even() ? 1.0 : pieces_[piece_before(t)].width_at(t); }
  /// Of the part from the tip to t [w Lgb].
  double weight_at(double t) const { return even() ? t : pieces_[piece_before(t)].weight_at(t); }

  /// 1 + share (scale b - 1): a way from an even sheet to this one.
  SheetWidth blended(double share, double scale) const;

 private:
  std::vector<Piece> pieces_;  // none of an even sheet
};

}  // namespace withe
