#include "elasticity/stencil_kernels.hpp"

namespace withe {

namespace baseline {
extern const StencilKernels kStencilKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const StencilKernels kStencilKernels;
}
#endif

const StencilKernels& stencil_kernels() {
#ifdef WITHE_X86_KERNELS
  static const StencilKernels& kernels = *pick(&baseline::kStencilKernels, &avx2::kStencilKernels);
#else
  static const StencilKernels& kernels = baseline::kStencilKernels;
#endif
  return kernels;
}

}  // namespace withe
