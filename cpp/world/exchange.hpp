#pragma once
/// What running consists of, value by value, as an archive reads or writes it.

namespace withe {

struct Model;
struct Running;
struct Lagged;

/// From or to an archive, Reader or Writer; those of users' parameters from which the rest follows.
template <class Archive>
void exchange(Archive& io, const Model& model, Running& running);

template <class Archive>
void exchange(Archive& io, Lagged& lagged);

}  // namespace withe
