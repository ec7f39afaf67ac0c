#include "common/instruction_set.hpp"

#include <cstdlib>
#include <string>

#include "common/check.hpp"

namespace withe {
namespace {

InstructionSet best_of_machine() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return InstructionSet::baseline;
  return InstructionSet::avx2;
#else
  return InstructionSet::baseline;
#endif
}

InstructionSet chosen() {
  const InstructionSet best = best_of_machine();
  const char* asked = std::getenv("WITHE_SIMD");
  if (!asked || !*asked) return best;
  for (InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2})
    if (std::string(asked) == name_of(set)) {
      require(set <= best, "WITHE_SIMD=" + std::string(asked) + ": this machine has no more than " + name_of(best));
      return set;
    }
  require(false, "WITHE_SIMD must be baseline or avx2, got " + std::string(asked));
  return best;
}

}  // namespace

InstructionSet instruction_set() {
  static const InstructionSet set = chosen();
  return set;
}

const char* name_of(InstructionSet set) { return set == InstructionSet::baseline ? "baseline" : "avx2"; }

}  // namespace withe
