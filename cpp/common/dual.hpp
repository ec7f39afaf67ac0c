#pragma once
/// A number with its derivatives by N unknowns: exact first derivatives of what is too long to derive by hand.

#include <cmath>

namespace withe {

template <int N>
struct Dual {
  double value = 0;
  double slope[N] = {};

  Dual() = default;
  Dual(double constant) : value(constant) {}  // NOLINT(google-explicit-constructor): constants mix with duals
  static Dual unknown(double value, int index) {
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
  friend Dual operator+(const Dual& a, double b) { return chain(a, a.value + b, 1.0); }
  friend Dual operator+(double a, const Dual& b) { return b + a; }
  friend Dual operator-(const Dual& a, double b) { return a + -b; }
  friend Dual operator-(double a, const Dual& b) { return chain(b, a - b.value, -1.0); }
  friend Dual operator*(double a, const Dual& b) { return chain(b, a * b.value, a); }
  friend Dual operator*(const Dual& a, double b) { return b * a; }
  friend Dual operator/(const Dual& a, double b) { return (1.0 / b) * a; }
  friend Dual operator/(double a, const Dual& b) {
    const double quotient = a / b.value;
    return chain(b, quotient, -quotient / b.value);
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    Dual c(a.value * b.value);
    for (int i = 0; i < N; ++i) c.slope[i] = a.slope[i] * b.value + a.value * b.slope[i];
    return c;
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double inverse = 1.0 / b.value;
    Dual c(a.value * inverse);
    for (int i = 0; i < N; ++i) c.slope[i] = inverse * (a.slope[i] - c.value * b.slope[i]);
    return c;
  }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }

  /// f(a), given f and its derivative there.
  friend Dual chain(const Dual& a, double value, double derivative) {
    Dual c(value);
    for (int i = 0; i < N; ++i) c.slope[i] = derivative * a.slope[i];
    return c;
  }
  friend Dual sqrt(const Dual& a) {
    const double root = std::sqrt(a.value);
    return chain(a, root, 0.5 / root);
  }
};

inline double value_of(double x) { return x; }
template <int N>
double value_of(const Dual<N>& x) {
  return x.value;
}
inline double chain(double /*a*/, double value, double /*derivative*/) { return value; }

}  // namespace withe
