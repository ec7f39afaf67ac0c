#pragma once
/// Elimination of one front by several threads.

#include <cstddef>
#include <functional>

#include "common/worker_pool.hpp"
#include "solvers/front_kernels.hpp"

namespace withe {

/// Pieces of a list of columns or rows for each thread: a thread that starts late does fewer of them.
inline constexpr int kPiecesPerWorker = 3;

/// First column of a piece of a lower triangle, whose columns become shorter, in pieces of equal area. It is a multiple
/// of kFrontPadding, but for the end of the last piece, `columns`.
int triangle_start(int columns, int piece, int pieces);

/// Calls work(first, end) for pieces of the columns of a lower triangle; without workers for all columns at once.
template <class Work>
void in_pieces(WorkerPool* workers, int columns, const Work& work) {
  if (!workers) return work(0, columns);
  const int pieces = kPiecesPerWorker * workers->workers();
  const auto one = [&](std::size_t piece) {
    const int k = static_cast<int>(piece);
    work(triangle_start(columns, k, pieces), triangle_start(columns, k + 1, pieces));
  };
  workers->run(static_cast<std::size_t>(pieces), std::ref(one));
}

/// As FrontKernels::eliminate, with the same bits.
void eliminate_together(WorkerPool& workers, const Front& lower, const Front& upper);

}  // namespace withe
