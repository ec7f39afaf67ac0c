#pragma once
/// Elimination of one front by several threads.

#include "common/worker_pool.hpp"
#include "solvers/front_kernels.hpp"

namespace withe {

/// As FrontKernels::eliminate, with the same bits.
void eliminate_together(WorkerPool& workers, const Front& lower, const Front& upper);

}  // namespace withe
