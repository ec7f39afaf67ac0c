#include "solvers/parallel_front.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace withe {
namespace {

int rounded_up(double number) { return static_cast<int>(std::ceil(number / kFrontPadding)) * kFrontPadding; }

}  // namespace

int triangle_start(int columns, int piece, int pieces) {
  if (piece == pieces) return columns;
  return std::min(columns, rounded_up(columns * (1.0 - std::sqrt(1.0 - static_cast<double>(piece) / pieces))));
}

void eliminate_together(WorkerPool& workers, const Front& lower, const Front& upper) {
  const FrontKernels& kernels = front_kernels();
  const bool symmetric = &lower == &upper;
  const int sides = symmetric ? 1 : 2, pieces = kPiecesPerWorker * workers.workers();
  const auto front = [&](int side) -> const Front& { return side == 0 ? lower : upper; };
  for (int first = 0; first < lower.columns; first += kPanelColumns) {
    const Panel panel{first, std::min(first + kPanelColumns, lower.columns)};
    kernels.eliminate_panel(lower, upper, panel);
    // Rows below, in pieces of equal height.
    const int below = rounded_up(panel.end), height = lower.length - below;
    const auto row = [&](int piece) {
      return std::min(below + rounded_up(1.0 * height * piece / pieces), lower.length);
    };
    const auto finish = [&](std::size_t task) {
      const int side = static_cast<int>(task) / pieces, piece = static_cast<int>(task) % pieces;
      kernels.finish_rows(front(side), front(1 - side), panel, row(piece), row(piece + 1));
    };
    workers.run(static_cast<std::size_t>(sides * pieces), std::ref(finish));
    for (int side = 0; side < sides; ++side)
      in_pieces(&workers, lower.rows - panel.end, [&](int column, int end) {
        kernels.update(front(side), front(1 - side), panel, panel.end + column, panel.end + end);
      });
  }
}

}  // namespace withe
