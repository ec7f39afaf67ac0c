#include "solvers/band_lu_kernels.hpp"

namespace withe {

namespace baseline {
extern const BandLuKernels kBandLuKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const BandLuKernels kBandLuKernels;
}
#endif

const BandLuKernels& band_lu_kernels() {
#ifdef WITHE_X86_KERNELS
  static const BandLuKernels& kernels = *pick(&baseline::kBandLuKernels, &avx2::kBandLuKernels);
#else
  static const BandLuKernels& kernels = baseline::kBandLuKernels;
#endif
  return kernels;
}

}  // namespace withe
