#include "solvers/band_kernels.hpp"

namespace withe {

namespace baseline {
extern const BandKernels kBandKernels[4];
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const BandKernels kBandKernels[4];
}
#endif

const BandKernels* band_kernels(int half_bandwidth) {
#ifdef WITHE_X86_KERNELS
  static const BandKernels* const kernels = pick(&baseline::kBandKernels[0], &avx2::kBandKernels[0]);
#else
  static const BandKernels* const kernels = baseline::kBandKernels;
#endif
  for (int i = 0; i < 4; ++i)
    if (half_bandwidth <= kernels[i].half_bandwidth) return kernels + i;
  return nullptr;
}

}  // namespace withe
