#pragma once
/// Which instructions the kernels use. One build carries them all; the best that the machine has is picked when the
/// program starts.

namespace withe {

enum class InstructionSet {
  baseline,  ///< available on every machine of the architecture, 2 doubles per pack
  avx2,      ///< x86-64-v3: AVX2 and FMA, 4
};

/// Kernels that add to an array may read and write this many numbers past its end (adding zeros).
constexpr int kPadding = 8;

/// Instruction set in use: the best of this machine, or the one that the environment variable WITHE_SIMD requests
/// (baseline or avx2). Throws std::invalid_argument for any other value, or if this machine does not support it.
InstructionSet instruction_set();
const char* name_of(InstructionSet set);

/// The table of kernels for the instruction set in use.
template <class Kernels>
const Kernels* pick(const Kernels* baseline, const Kernels* avx2) {
  return instruction_set() == InstructionSet::avx2 ? avx2 : baseline;
}

}  // namespace withe
