#include "forces/stokeslet_kernels.hpp"

namespace withe {

namespace baseline {
extern const StokesletKernels kStokesletKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const StokesletKernels kStokesletKernels;
}
#endif

const StokesletKernels& stokeslet_kernels() {
#ifdef WITHE_X86_KERNELS
  static const StokesletKernels& kernels = *pick(&baseline::kStokesletKernels, &avx2::kStokesletKernels);
#else
  static const StokesletKernels& kernels = baseline::kStokesletKernels;
#endif
  return kernels;
}

}  // namespace withe
