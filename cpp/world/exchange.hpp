#pragma once
/// The values of a running scene in the order in which an archive reads or writes them.

namespace withe {

struct Model;
struct Running;
struct Lagged;

/// Reads from a Reader or writes to a Writer. Of the parameters only those that users set are stored; the others
/// follow.
template <class Archive>
void exchange(Archive& io, const Model& model, Running& running);

template <class Archive>
void exchange(Archive& io, Lagged& lagged);

}  // namespace withe
