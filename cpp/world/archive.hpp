#pragma once
/// Bytes of a snapshot: plain numbers one after the other, checked when read.

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "common/check.hpp"
#include "common/types.hpp"

namespace withe {

class Writer {
 public:
  std::string bytes;

  void raw(const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); }
  template <class Number>
    requires std::is_arithmetic_v<Number>
  void operator()(const Number& number) {
    raw(&number, sizeof number);
  }
  template <class Derived>
  void operator()(const Eigen::PlainObjectBase<Derived>& m) {
    (*this)(static_cast<std::int64_t>(m.rows()));
    (*this)(static_cast<std::int64_t>(m.cols()));
    raw(m.data(), static_cast<std::size_t>(m.size()) * sizeof(double));
  }
  template <class Matrix>
  void operator()(const Eigen::Map<Matrix>& m) {
    (*this)(static_cast<std::int64_t>(m.rows()));
    (*this)(static_cast<std::int64_t>(m.cols()));
    raw(m.data(), static_cast<std::size_t>(m.size()) * sizeof(double));
  }
  void operator()(const std::vector<double>& numbers) {
    (*this)(static_cast<std::int64_t>(numbers.size()));
    raw(numbers.data(), numbers.size() * sizeof(double));
  }
};

class Reader {
 public:
  explicit Reader(std::string bytes) : bytes_(std::move(bytes)) {}

  void raw(void* data, std::size_t size) {
    require(size <= bytes_.size() - position_, "snapshot is damaged: it ends too early");
    if (size > 0) std::memcpy(data, bytes_.data() + position_, size);  // nothing has no address
    position_ += size;
  }
  template <class Number>
    requires std::is_arithmetic_v<Number>
  void operator()(Number& number) {
    raw(&number, sizeof number);
  }
  void operator()(bool& flag) {
    unsigned char byte = 0;
    raw(&byte, sizeof byte);
    require(byte <= 1, "snapshot is damaged: a flag is neither on nor off");
    flag = byte == 1;
  }
  /// Sizes must be those that the matrix has already.
  template <class Derived>
  void operator()(Eigen::PlainObjectBase<Derived>& m) {
    std::int64_t rows = 0, columns = 0;
    (*this)(rows);
    (*this)(columns);
    require(rows == m.rows() && columns == m.cols(), "snapshot belongs to another scene: sizes differ");
    raw(m.data(), static_cast<std::size_t>(m.size()) * sizeof(double));
  }
  template <class Matrix>
  void operator()(Eigen::Map<Matrix>& m) {
    std::int64_t rows = 0, columns = 0;
    (*this)(rows);
    (*this)(columns);
    require(rows == m.rows() && columns == m.cols(), "snapshot belongs to another scene: sizes differ");
    raw(m.data(), static_cast<std::size_t>(m.size()) * sizeof(double));
  }
  void operator()(std::vector<double>& numbers) {
    std::int64_t count = 0;
    (*this)(count);
    require(count >= 0 && static_cast<std::size_t>(count) <= (bytes_.size() - position_) / sizeof(double),
            "snapshot is damaged: it ends too early");
    numbers.resize(static_cast<std::size_t>(count));
    raw(numbers.data(), numbers.size() * sizeof(double));
  }
  void expect_end() const { require(position_ == bytes_.size(), "snapshot is damaged: it is too long"); }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

}  // namespace withe
