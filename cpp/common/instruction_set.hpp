#pragma once
/// Which instructions the kernels use. One build carries them all; the best that the machine has is picked when the
/// program starts.

namespace withe {

enum class InstructionSet {
  baseline,  ///< what every machine of the architecture has, 2 doubles a pack
  avx2,      ///< x86-64-v3: AVX2 and FMA, 4
};

/// Kernels that add to an array may read and write this many numbers past its end (adding zeros).
constexpr int kPadding = 8;

/// The one in use: the best of this machine, or what the environment variable WITHE_SIMD (baseline or avx2) asks for.
/// Throws std::invalid_argument for another word or one that this machine cannot run.
InstructionSet instruction_set();
const char* name_of(InstructionSet set);

/// The table of kernels for the instruction set in use.
template <class Kernels>
const Kernels* pick(const Kernels* baseline, const Kernels* avx2) {
  return instruction_set() == InstructionSet::avx2 ? avx2 : baseline;
}

}  // namespace withe
