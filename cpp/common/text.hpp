#pragma once

#include <cstdio>
#include <string>

namespace withe {

/// A number in the usual notation, with `digits` digits.
inline std::string text(double number, int digits = 3) {
  char words[32];
  std::snprintf(words, sizeof words, "%.*g", digits, number);
  return words;
}

}  // namespace withe
