#include "geometry/frame_kernels.hpp"

namespace withe {

namespace baseline {
extern const FrameKernels kFrameKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const FrameKernels kFrameKernels;
}
#endif

const FrameKernels& frame_kernels() {
#ifdef WITHE_X86_KERNELS
  static const FrameKernels& kernels = *pick(&baseline::kFrameKernels, &avx2::kFrameKernels);
#else
  static const FrameKernels& kernels = baseline::kFrameKernels;
#endif
  return kernels;
}

}  // namespace withe
