#include "elastica/sheet_kernels.hpp"

namespace withe {

namespace baseline {
extern const SheetKernels kSheetKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const SheetKernels kSheetKernels;
}
#endif

const SheetKernels& sheet_kernels() {
#ifdef WITHE_X86_KERNELS
  static const SheetKernels& kernels = *pick(&baseline::kSheetKernels, &avx2::kSheetKernels);
#else
  static const SheetKernels& kernels = baseline::kSheetKernels;
#endif
  return kernels;
}

}  // namespace withe
