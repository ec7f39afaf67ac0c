#pragma once
/// Warnings about how a scene is run; each kind is reported once.

#include <array>
#include <optional>
#include <string>
#include <utility>

namespace withe {

enum class Warning {
  mesh,      ///< the mesh is too coarse for the motion
  steps,     ///< steps are too long for the motion
  impact,    ///< steps are too long for an impact
  branch,    ///< a static step has left its branch of equilibria
  plane,     ///< an equilibrium is unstable out of its plane
  drift,     ///< the integrator changes the energy
  crossing,  ///< rods pass through each other
  squeeze,   ///< obstacles squeeze a rod, and no contact stiffness is given
  count,     ///< number of kinds
};

class Warnings {
 public:
  /// The message of a kind that is yet to be read; empty: none.
  const std::string& operator[](Warning kind) const {
    static const std::string none;
    const std::optional<std::string>& message = messages_[index(kind)];
    return message ? *message : none;
  }
  /// True if the kind was reported, also if it has been read.
  bool has_reported(Warning kind) const { return messages_[index(kind)].has_value(); }
  /// Reports a kind unless it was reported before; no message: nothing.
  void report(Warning kind, std::string message) {
    if (!has_reported(kind) && !message.empty()) messages_[index(kind)] = std::move(message);
  }
  /// Messages that are yet to be read; they count as read from here on.
  Warnings take() {
    Warnings out;
    for (std::size_t k = 0; k < messages_.size(); ++k)
      if (messages_[k] && !messages_[k]->empty()) out.messages_[k] = std::exchange(*messages_[k], {});
    return out;
  }
  /// Reports what others report.
  void add(const Warnings& other) {
    for (std::size_t k = 0; k < messages_.size(); ++k)
      if (!messages_[k]) messages_[k] = other.messages_[k];
  }

 private:
  static std::size_t index(Warning kind) { return static_cast<std::size_t>(kind); }

  std::array<std::optional<std::string>, static_cast<std::size_t>(Warning::count)> messages_;
};

}  // namespace withe
