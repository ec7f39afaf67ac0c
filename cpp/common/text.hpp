#pragma once

#include <cstdio>
#include <string>

namespace withe {

/// A number as people write it, with so many digits.
inline std::string text(double number, int digits = 3) {
  char words[32];
  std::snprintf(words, sizeof words, "%.*g", digits, number);
  return words;
}

}  // namespace withe
