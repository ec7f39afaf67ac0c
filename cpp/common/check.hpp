#pragma once
/// Checks of input at the border, also in release builds. Inner loops use assert instead.

#include <stdexcept>
#include <string>

namespace withe {

/// Throws std::invalid_argument (ValueError in Python) with the given message unless the condition holds.
inline void require(bool condition, const std::string& message) {
  if (!condition) throw std::invalid_argument(message);
}

}  // namespace withe
