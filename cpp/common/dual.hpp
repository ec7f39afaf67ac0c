#pragma once
/// A number with its derivatives by N unknowns. It gives exact first derivatives of expressions that are too long to
/// derive by hand. A Number is a double, or a pack of doubles.

#include <cmath>

namespace withe {

template <int N, class Number = double>
struct Dual {
  Number value = 0.0;
  Number slope[N] = {};

  Dual() = default;
  Dual(Number constant) : value(constant) {}  // NOLINT(google-explicit-constructor): constants mix with duals
  static Dual unknown(Number value, int index) {
    Dual d(value);
    d.slope[index] = 1.0;
    return d;
  }

  friend Dual operator+(const Dual& a, const Dual& b) {
    Dual c(a.value + b.value);
    for (int i = 0; i < N; ++i) c.slope[i] = a.slope[i] + b.slope[i];
    return c;
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    Dual c(a.value - b.value);
    for (int i = 0; i < N; ++i) c.slope[i] = a.slope[i] - b.slope[i];
    return c;
  }
  friend Dual operator-(const Dual& a) { return -1.0 * a; }
  // With constants, which most products have.
  friend Dual operator+(const Dual& a, Number b) { return chain(a, a.value + b, 1.0); }
  friend Dual operator+(Number a, const Dual& b) { return b + a; }
  friend Dual operator-(const Dual& a, Number b) { return a + -b; }
  friend Dual operator-(Number a, const Dual& b) { return chain(b, a - b.value, -1.0); }
  friend Dual operator*(Number a, const Dual& b) { return chain(b, a * b.value, a); }
  friend Dual operator*(const Dual& a, Number b) { return b * a; }
  friend Dual operator/(const Dual& a, Number b) { return (1.0 / b) * a; }
  friend Dual operator/(Number a, const Dual& b) {
    const Number quotient = a / b.value;
    return chain(b, quotient, -quotient / b.value);
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    Dual c(a.value * b.value);
    for (int i = 0; i < N; ++i) c.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
    return c;
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const Number inverse = 1.0 / b.value;
    Dual c(a.value * inverse);
    for (int i = 0; i < N; ++i) c.slope[i] = inverse * (a.slope[i] - c.value * b.slope[i]);
    return c;
  }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }

  /// f(a), given f and its derivative there.
  friend Dual chain(const Dual& a, Number value, Number derivative) {
    Dual c(value);
    for (int i = 0; i < N; ++i) c.slope[i] = derivative * a.slope[i];
    return c;
  }
  friend Dual sqrt(const Dual& a) {
    const Number root = std::sqrt(a.value);
    return chain(a, root, 0.5 / root);
  }
};

inline double value_of(double x) { return x; }
template <int N, class Number>
Number value_of(const Dual<N, Number>& x) {
  return x.value;
}
inline double chain(double /*a*/, double value, double /*derivative*/) { return value; }

}  // namespace withe
