#pragma once
/// Checks of input at the border, also in release builds. Inner loops use assert instead.

#include <stdexcept>
#include <string>

namespace withe {

/// Throws std::invalid_argument (ValueError in Python) unless the condition holds. The message is composed of the
/// strings and numbers only if the check fails: a check that passes does not allocate.
template <class... Parts>
void require(bool condition, const Parts&... parts) {
  if (condition) return;
  const auto text = [](const auto& part) {
    if constexpr (requires { std::to_string(part); })
      return std::to_string(part);
    else
      return std::string(part);
  };
  throw std::invalid_argument((text(parts) + ...));
}

}  // namespace withe
