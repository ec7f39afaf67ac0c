#include "elastica/sheet_width.hpp"

#include "common/check.hpp"

namespace withe {

SheetWidth::SheetWidth(const std::vector<double>& places, const std::vector<double>& widths) {
  require(places.size() == widths.size() && !places.empty() && places.front() == 0.0,
          "widths must be as many as places, of which the first is 0");
  double weight = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    require(widths[i] >= 0, "widths must not be negative");
    Piece piece{places[i], widths[i], 0.0, weight};
    if (i + 1 < places.size()) {
      const double length = places[i + 1] - places[i];
      require(length > 0, "places must increase");
      piece.slope = (widths[i + 1] - widths[i]) / length;
      weight += 0.5 * length * (widths[i] + widths[i + 1]);
    }
    pieces_.push_back(piece);
  }
}

std::size_t SheetWidth::piece_before(double t) const {
  std::size_t piece = pieces_.size() - 1;
  while (piece > 0 && !(pieces_[piece].begin < t)) --piece;
  return piece;
}

SheetWidth SheetWidth::blended(double share, double scale) const {
  SheetWidth blend = *this;
  for (Piece& piece : blend.pieces_) {
    piece.width = 1 + share * (scale * piece.width - 1);
    piece.slope *= share * scale;
    piece.weight = (1 - share) * piece.begin + share * scale * piece.weight;
  }
  return blend;
}

}  // namespace withe
