#include "assembly/assembler.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace withe {
namespace {

void append(std::vector<int>& dofs, int first, int count) {
  for (int i = 0; i < count; ++i) dofs.push_back(first < 0 ? -1 : first + i);
}

std::vector<int> stretch_dofs(const Model& model) {
  std::vector<int> dofs;
  for (int e = 0; e < model.edge_count; ++e) {
    append(dofs, model.node_dof[at(model.edge_tail[at(e)])], model.dimension);
    append(dofs, model.node_dof[at(model.edge_head[at(e)])], model.dimension);
  }
  return dofs;
}

std::vector<int> bend_dofs(const Model& model) {
  std::vector<int> dofs;
  for (const BendStencil& s : model.bend)
    for (int i = 0; i < 3; ++i) {
      append(dofs, model.node_dof[at(s.node[i])], model.dimension);
      if (i < 2 && !model.planar()) append(dofs, model.edge_dof[at(s.edge[i])], 1);
    }
  return dofs;
}

std::vector<int> half_dofs(const Model& model) {
  std::vector<int> dofs;
  for (const FrameStencil& s : model.half) {
    append(dofs, model.node_dof[at(model.edge_tail[at(s.edge)])], model.dimension);
    if (!model.planar()) append(dofs, model.edge_dof[at(s.edge)], 1);
    append(dofs, model.node_dof[at(model.edge_head[at(s.edge)])], model.dimension);
    append(dofs, model.frame_dof[at(s.frame)], model.frame_size());
    if (!model.planar()) append(dofs, s.hinge < 0 ? -1 : model.hinges[at(s.hinge)].dof, 1);
  }
  return dofs;
}

RegularStencils regular_stencils(const Model& model, const ElementTable& bend) {
  RegularStencils out;
  std::vector<bool> taken(at(model.edge_count), false);
  for (int b = 0; b < bend.count(); ++b) {
    const BendStencil& s = model.bend[at(b)];
    if (s.sign[0] < 0 || s.sign[1] < 0 || !bend.regular(b, out.lines)) {
      out.other_bend.push_back(b);
      continue;
    }
    out.by_rows = bend.by_rows(b);
    out.stencil.push_back(b);
    out.first_unknown.push_back(bend.dofs(b)[0]);
    for (int edge : s.edge) {
      out.edges.push_back(edge);
      out.owned.push_back(taken[at(edge)] ? 0.0 : 1.0);
      taken[at(edge)] = true;
    }
  }
  for (int e = 0; e < model.edge_count; ++e)
    if (!taken[at(e)]) out.other_edges.push_back(e);
  return out;
}

}  // namespace

void ElementTable::find_offsets(const Assembler& assembler) {
  symmetric_ = assembler.solver().symmetry() == Symmetry::symmetric;
  offsets_.clear();
  starts_.clear();
  for (int e = 0; e < count(); ++e) {
    starts_.push_back(static_cast<std::ptrdiff_t>(offsets_.size()));
    const int* d = dofs(e);
    for (int i = 0; i < width_; ++i)
      for (int j = 0; j < (symmetric_ ? i + 1 : width_); ++j)
        if (d[i] >= 0 && d[j] >= 0) offsets_.push_back(static_cast<int>(assembler.place(d[i], d[j])));
  }
}

bool ElementTable::regular(int element, std::vector<std::ptrdiff_t>& lines) const {
  const int* d = dofs(element);
  for (int i = 0; i < width_; ++i)
    if (d[i] < 0 || d[i] != d[0] + i) return false;
  const auto entry = [&](int i, int j) { return offsets(element)[symmetric_ ? i * (i + 1) / 2 + j : i * width_ + j]; };
  bool by_rows = !symmetric_, by_columns = true;
  for (int i = 0; i < width_; ++i)
    for (int j = 0; j < (symmetric_ ? i + 1 : width_); ++j) {
      by_rows = by_rows && entry(i, j) == entry(i, 0) + j;
      by_columns = by_columns && entry(i, j) == (symmetric_ ? entry(j, j) + i - j : entry(0, j) + i);
    }
  if (!by_rows && !by_columns) return false;
  for (int i = 0; i < width_; ++i) lines.push_back(symmetric_ ? entry(i, i) : by_rows ? entry(i, 0) : entry(0, i));
  return true;
}

std::ptrdiff_t ElementTable::offset(int element, int i, int j) const {
  const int* d = dofs(element);
  if (d[i] < 0 || d[j] < 0) return -1;
  const int row = present(element, i), column = present(element, j);
  if (!symmetric_) return offsets(element)[row * present(element, width_) + column];
  return offsets(element)[std::max(row, column) * (std::max(row, column) + 1) / 2 + std::min(row, column)];
}

void ElementTable::add_gradient(int element, const double* gradient, double scale, VectorX& residual,
                                VectorX& magnitude) const {
  const int* d = dofs(element);
  for (int i = 0; i < width_; ++i) {
    if (d[i] < 0) continue;
    residual(d[i]) += scale * gradient[i];
    magnitude(d[i]) += std::abs(scale * gradient[i]);
  }
}

void ElementTable::add_hessian(int element, const double* hessian, int stride, double scale,
                               std::span<double> values) const {
  const int* offset = offsets(element);
  const int* unknown = dofs(element);
  for (int i = 0; i < width_; ++i) {
    if (unknown[i] < 0) continue;
    for (int j = 0; j < (symmetric_ ? i + 1 : width_); ++j)
      if (unknown[j] >= 0) values[static_cast<std::size_t>(*offset++)] += scale * hessian[i * stride + j];
  }
}

void ElementTable::add_dense_hessian(int element, const double* hessian, int stride, double scale,
                                     std::span<double> values) const {
  const int* offset = offsets(element);
  const int size = present(element, width_);
  for (int i = 0; i < size; ++i)
    for (int j = 0; j < (symmetric_ ? i + 1 : size); ++j)
      values[static_cast<std::size_t>(*offset++)] += scale * hessian[i * stride + j];
}

Assembler::Assembler(const Model& model, std::vector<ElementTable*> declared, Symmetry symmetry, SolverKind kind,
                     bool exact)
    : stretch(2 * model.dimension, stretch_dofs(model)),
      bend(model.planar() ? 6 : 11, bend_dofs(model)),
      half(model.planar() ? 5 : 11, half_dofs(model)),
      model_(model),
      symmetry_(symmetry),
      kind_(kind),
      declared_(std::move(declared)),
      exact_(exact) {
  const auto add_cliques = [&](const ElementTable& table) {
    for (int e = 0; e < table.count(); ++e) cliques_.emplace_back(table.dofs(e), table.dofs(e) + table.width());
  };
  if (!model.carried.empty()) {
    carried_.assign(at(model.dof_count), -1);
    for (std::size_t i = 0; i < model.carried.size(); ++i)
      std::fill_n(carried_.begin() + model.carried[i].own_dof, model.carried[i].own_size, static_cast<int>(i));
  }
  add_cliques(stretch);
  add_cliques(bend);
  add_cliques(half);
  for (const ElementTable* table : declared_) add_cliques(*table);
  for (int i = 0; i < model.dof_count; ++i) cliques_.push_back({i});
  for (int frame : model.body_frame) {
    cliques_.emplace_back();
    append(cliques_.back(), model.frame_dof[at(frame)], model.frame_size());
  }
  for (const Constraint& c : model.constraints) {
    std::vector<int> own;
    for (int i = 0; i < c.size; ++i) own.push_back(c.first + i);
    cliques_.push_back(own);
  }
  analyse();
}

void Assembler::couple(const std::vector<int>& contact_unknowns, int width) {
  contact = ElementTable(width, contact_unknowns);
  for (int e = 0; e < contact.count(); ++e)
    for (int i = 0; i < width; ++i)
      for (int j = 0; j < i; ++j) {
        const int row = contact.dofs(e)[i], column = contact.dofs(e)[j];
        if (row >= 0 && column >= 0 && !whole_pattern().contains(row, column)) {
          analyse();
          return;
        }
      }
  contact.find_offsets(*this);
}

void Assembler::order_for(const std::vector<int>& contact_unknowns, int width) {
  contact = ElementTable(width, contact_unknowns);
  analyse();
}

void Assembler::couple_groups(const std::vector<std::vector<int>>& groups) {
  const std::size_t known = groups_.size();
  for (const std::vector<int>& group : groups)
    if (!std::all_of(group.begin(), group.end(), [&](int row) {
          return std::all_of(group.begin(), group.end(),
                             [&](int column) { return whole_pattern().contains(row, column); });
        }))
      groups_.push_back(group);
  if (groups_.size() > known) analyse();
}

void Assembler::set_groups(const std::vector<std::vector<int>>& groups) {
  if (groups == groups_) return;
  groups_ = groups;
  analyse();
}

/// The pattern of all tables, its solver, and where everything goes.
void Assembler::analyse() {
  std::vector<std::vector<int>> cliques = cliques_;
  cliques.insert(cliques.end(), groups_.begin(), groups_.end());
  for (int e = 0; e < contact.count(); ++e) cliques.emplace_back(contact.dofs(e), contact.dofs(e) + contact.width());
  add_bodies_to(cliques);
  pattern_ = SparsityPattern::from_cliques(model_.dof_count, cliques);
  if (!carried_.empty()) set_beside();
  solver_ = make_linear_solver(pattern_, symmetry_, kind_);
  solver_->share_work(workers_);
  const auto first = static_cast<std::ptrdiff_t>(solver_->values().size()) - pattern_.beside;
  for (std::ptrdiff_t& place : beside_)
    if (place >= 0) place += first;
  ++generation_;
  for (ElementTable* table : {&stretch, &bend, &half, &contact}) table->find_offsets(*this);
  for (ElementTable* table : declared_) table->find_offsets(*this);
  find_edge_couplings();
  diagonal_.clear();
  for (int i = 0; i < model_.dof_count; ++i) diagonal_.push_back(place(i, i));
  regular = regular_stencils(model_, bend);
  find_blocks();
  find_folds();
  entries_.clear();
  for (int column = 0; exact_ && column < pattern_.size; ++column)
    for (int k = pattern_.column_starts[at(column)]; k < pattern_.column_starts[at(column) + 1]; ++k) {
      const int row = pattern_.row_indices[at(k)];
      entries_.push_back(solver_->place(row, column));
    }
}

void Assembler::set_beside() {
  std::swap(whole_, pattern_);
  pattern_ = {};
  pattern_.size = whole_.size;
  pattern_.column_starts.assign(1, 0);
  beside_.assign(whole_.row_indices.size(), -1);
  for (int column = 0; column < whole_.size; ++column) {
    for (int k = whole_.column_starts[at(column)]; k < whole_.column_starts[at(column) + 1]; ++k) {
      const int row = whole_.row_indices[at(k)];
      const bool is_carried = carried(row) || carried(column);
      if (!is_carried || row == column) pattern_.row_indices.push_back(row);
      if (is_carried && (symmetry_ != Symmetry::symmetric || row >= column)) beside_[at(k)] = pattern_.beside++;
    }
    pattern_.column_starts.push_back(static_cast<int>(pattern_.row_indices.size()));
  }
}

std::ptrdiff_t Assembler::place(int row, int column) const {
  if (!carried(row) && !carried(column)) return solver_->place(row, column);
  if (symmetry_ == Symmetry::symmetric && row < column) std::swap(row, column);
  const std::ptrdiff_t found = whole_.find(row, column);
  if (found < 0) throw std::invalid_argument("entry of a carried part outside of the pattern");
  return beside_[static_cast<std::size_t>(found)];
}

void Assembler::multiply(const VectorX& x, VectorX& out) const {
  const std::span<const double> values = std::as_const(*solver_).values();
  out.setZero(pattern_.size);
  for (int column = 0; column < pattern_.size; ++column)
    for (int k = pattern_.column_starts[at(column)]; k < pattern_.column_starts[at(column) + 1]; ++k)
      out[pattern_.row_indices[at(k)]] += values[static_cast<std::size_t>(entries_[at(k)])] * x[column];
}

void Assembler::multiply_transposed(const VectorX& x, VectorX& out) const {
  out.resize(pattern_.size);
  for (int column = 0; column < pattern_.size; ++column) out[column] = transposed_row(column, x);
}

void Assembler::multiply_held_transposed(const VectorX& x, VectorX& out) const {
  for (const Constraint& c : model_.constraints)
    for (int i = 0; i < c.size; ++i) out[c.first + i] = transposed_row(c.first + i, x);
}

double Assembler::transposed_row(int column, const VectorX& x) const {
  const std::span<const double> values = std::as_const(*solver_).values();
  double sum = 0.0;
  for (int k = pattern_.column_starts[at(column)]; k < pattern_.column_starts[at(column) + 1]; ++k)
    sum += values[static_cast<std::size_t>(entries_[at(k)])] * x[pattern_.row_indices[at(k)]];
  return sum;
}

void Assembler::find_edge_couplings() {
  edge_couplings.clear();
  const int size = model_.dimension;
  for (int e = 0; e < model_.edge_count; ++e)
    for (int i = 0; i < size; ++i) {
      const std::ptrdiff_t between = stretch.offset(e, i, size + i), other = stretch.offset(e, size + i, i);
      for (std::ptrdiff_t entry :
           {stretch.offset(e, i, i), stretch.offset(e, size + i, size + i), between, other == between ? -1 : other})
        edge_couplings.push_back(entry);
    }
}

/// Rows and columns of held unknowns.
void Assembler::find_blocks() {
  blocks_.clear();
  const bool symmetric = symmetry_ == Symmetry::symmetric;
  const auto entry = [&](int r, int c) { return solver_->place(r, c); };
  const auto coupled = [&](int r, int c) { return pattern_.contains(r, c); };
  for (const Constraint& c : model_.constraints) {
    Block block{c, {}, {}, {}};
    std::vector<int> others;
    for (int i = 0; i < c.size; ++i)
      for (int k = pattern_.column_starts[at(c.first + i)]; k < pattern_.column_starts[at(c.first + i) + 1]; ++k)
        others.push_back(pattern_.row_indices[at(k)]);
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    for (int other : others) {
      if (other >= c.first && other < c.first + c.size) continue;
      Coupling row{{-1, -1, -1}, false}, column{{-1, -1, -1}, false};
      for (int i = 0; i < c.size; ++i) {
        if (coupled(c.first + i, other)) row.offset[i] = entry(c.first + i, other);
        if (!symmetric && coupled(other, c.first + i)) column.offset[i] = entry(other, c.first + i);
      }
      block.rows.push_back(row);
      if (!symmetric) block.columns.push_back(column);
    }
    for (int i = 0; i < c.size; ++i)
      for (int j = 0; j < c.size; ++j) block.own[i][j] = entry(c.first + i, c.first + j);
    blocks_.push_back(block);
  }
}

/// Forces on a carried part act on its body.
void Assembler::add_bodies_to(std::vector<std::vector<int>>& cliques) const {
  if (carried_.empty()) return;
  for (std::vector<int>& clique : cliques)
    for (std::size_t k = 0; k < clique.size(); ++k) {  // also of those that are added: bodies carry bodies
      if (clique[k] < 0 || !carried(clique[k])) continue;
      const CarriedPart& part = model_.carried[at(carried_[at(clique[k])])];
      const auto add = [&](int dof) {
        if (std::find(clique.begin(), clique.end(), dof) == clique.end()) clique.push_back(dof);
      };
      for (int i = 0; i < part.own_size; ++i) add(part.own_dof + i);
      // Held unknowns are projected out, so that nothing couples through a held body.
      for (int dof : part.body_dofs)
        if (!part.is_held) add(dof);
    }
}

void Assembler::find_folds() {
  folds_.clear();
  const SparsityPattern& whole = whole_pattern();
  const auto place_of = [&](int row, int column) {
    return whole.contains(row, column) ? place(row, column) : std::ptrdiff_t{-1};
  };
  for (const CarriedPart& part : model_.carried) {
    std::vector<int> own, others;
    append(own, part.own_dof, part.own_size);
    const std::vector<int> body = part.is_held ? std::vector<int>{} : part.body_dofs;
    std::vector<int> square = own;
    square.insert(square.end(), body.begin(), body.end());
    for (int dof : own)
      for (int k = whole.column_starts[at(dof)]; k < whole.column_starts[at(dof) + 1]; ++k)
        if (const int other = whole.row_indices[at(k)]; std::find(square.begin(), square.end(), other) == square.end())
          others.push_back(other);
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    Fold fold;
    fold.own = part.own_size;
    fold.body = static_cast<int>(body.size());
    fold.others = static_cast<int>(others.size());
    const auto list = [&](const std::vector<int>& rows, const std::vector<int>& columns, auto& out) {
      for (int row : rows)
        for (int column : columns) out.push_back(place_of(row, column));
    };
    list(own, others, fold.rows);
    list(body, others, fold.onto_rows);
    if (symmetry_ != Symmetry::symmetric) {
      list(others, own, fold.columns);
      list(others, body, fold.onto_columns);
    }
    list(square, square, fold.square);
    for (int dof : own) fold.diagonal.push_back(solver_->offset(dof, dof));
    folds_.push_back(std::move(fold));
  }
}

namespace {

/// An entry that is taken out of the matrix; 0 if there is none.
double taken(std::span<double> values, std::ptrdiff_t place) {
  return place < 0 ? 0.0 : std::exchange(values[static_cast<std::size_t>(place)], 0.0);
}

}  // namespace

/// A part has the unknowns d, and its body u. With dd = G du, and rows r_u += H r_d: K_uj += H K_dj, K_ju += K_jd G.
/// Most parts of a surface touch nothing, and their rows and columns are zero.
void Assembler::fold_carried(const CarryingOf& carrying_of) {
  const std::span<double> values = solver_->values();
  const bool symmetric = symmetry_ == Symmetry::symmetric;
  const auto add = [&](std::ptrdiff_t place, double value) {
    if (value != 0.0) values[static_cast<std::size_t>(place)] += value;
  };
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Carrying::kMost, Carrying::kMost>;
  for (std::size_t i = folds_.size(); i-- > 0;) {  // parts of parts first
    const Fold& fold = folds_[i];
    const int d = fold.own, u = fold.body, n = fold.others, all = d + u;
    const Carrying* carrying = carrying_of(i, false);
    for (int j = 0; j < n; ++j) {
      double row[3] = {0, 0, 0}, column[3] = {0, 0, 0};
      bool any = false;
      for (int a = 0; a < d; ++a) {
        row[a] = taken(values, fold.rows[at(a * n + j)]);
        if (!symmetric) column[a] = taken(values, fold.columns[at(j * d + a)]);
        any = any || row[a] != 0.0 || column[a] != 0.0;
      }
      if (!any) continue;
      if (carrying == nullptr) carrying = carrying_of(i, true);
      const auto& G = carrying->follow;
      const auto& H = carrying->act;
      for (int b = 0; b < u; ++b) {
        double down = 0.0, right = 0.0;
        for (int a = 0; a < d; ++a) {
          down += H(b, a) * row[a];
          right += column[a] * G(a, b);
        }
        add(fold.onto_rows[at(b * n + j)], down);
        if (!symmetric) add(fold.onto_columns[at(j * u + b)], right);
      }
    }
    const auto square = [&](int r, int c) -> double& {
      return values[static_cast<std::size_t>(fold.square[at(r * all + c)])];
    };
    Small dd(d, d), du(d, u), ud(u, d);
    bool any = false;
    for (int a = 0; a < d; ++a) {
      for (int b = 0; b < d; ++b) any = (dd(a, b) = square(a, b)) != 0.0 || any;
      for (int b = 0; b < u; ++b) {
        any = (du(a, b) = square(a, d + b)) != 0.0 || any;
        any = (ud(b, a) = square(d + b, a)) != 0.0 || any;
      }
    }
    const double size = dd.norm() / std::sqrt(d);
    for (int a = 0; a < d; ++a) {
      for (int b = 0; b < d; ++b) square(a, b) = a != b ? 0.0 : size > 0.0 ? size : 1.0;
      values[static_cast<std::size_t>(fold.diagonal[at(a)])] = square(a, a);
      for (int b = 0; b < u; ++b) square(a, d + b) = square(d + b, a) = 0.0;
    }
    if (any && carrying == nullptr) carrying = carrying_of(i, true);
    if (carrying == nullptr) continue;
    Small uu = carrying->slope.topLeftCorner(u, u);
    if (any) {
      const auto G = carrying->follow.topLeftCorner(d, u);
      const auto H = carrying->act.topLeftCorner(u, d);
      const Small right = dd * G;
      uu = H * du + ud * G + H * right + uu;
    }
    for (int a = 0; a < u; ++a)
      for (int b = 0; b < (symmetric ? a + 1 : u); ++b) square(d + a, d + b) += uu(a, b);
  }
}

void Assembler::project_matrix() {
  project_matrix([](std::size_t) {});
}

void Assembler::project_for_now() {
  replaced_.clear();
  const std::span<const double> values = std::as_const(*solver_).values();
  project_matrix([&](std::size_t place) { replaced_.emplace_back(place, values[place]); });
}

/// Restores rows and columns where two constraints meet, in the reverse order of their changes.
void Assembler::take_back_projection() {
  const std::span<double> values = solver_->values();
  for (std::size_t i = replaced_.size(); i-- > 0;) values[replaced_[i].first] = replaced_[i].second;
}

template <class Before>
void Assembler::project_matrix(const Before& before) {
  const std::span<double> values = solver_->values();
  const auto put = [&](std::ptrdiff_t offset, double value) {
    const auto place = static_cast<std::size_t>(offset);
    before(place);
    values[place] = value;
  };
  for (const Block& block : blocks_) {
    const int n = block.constraint.size;
    const Matrix3& P = block.constraint.free;
    const auto apply = [&](const Coupling& c) {
      double v[3] = {0, 0, 0}, w[3] = {0, 0, 0};
      for (int i = 0; i < n; ++i) v[i] = c.offset[i] < 0 ? 0.0 : values[static_cast<std::size_t>(c.offset[i])];
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) w[i] += P(i, j) * v[j];
      for (int i = 0; i < n; ++i)
        if (c.offset[i] >= 0) put(c.offset[i], w[i]);
    };
    for (const Coupling& c : block.rows) apply(c);
    for (const Coupling& c : block.columns) apply(c);
    Matrix3 own = Matrix3::Zero(), p = Matrix3::Zero();
    p.topLeftCorner(n, n) = P.topLeftCorner(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) own(i, j) = values[static_cast<std::size_t>(block.own[i][j])];
    // The diagonal of held rows has the size of the other entries, for any orientation in space.
    const double size = own.norm() / std::sqrt(n), scale = size > 0.0 ? size : 1.0;
    own = p * own * p + scale * (Matrix3::Identity() - p);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) put(block.own[i][j], own(i, j));
  }
}

double* Assembler::entry(int row, int column, std::span<double> values) const {
  if (!whole_pattern().contains(row, column)) return nullptr;
  return &values[static_cast<std::size_t>(place(row, column))];
}

void Assembler::turn_rows(int first, const Matrix3& by, std::span<double> values) const {
  const SparsityPattern& whole = whole_pattern();
  for (int k = whole.column_starts[at(first)]; k < whole.column_starts[at(first) + 1]; ++k) {
    const int column = whole.row_indices[at(k)];
    Vector3 rows;
    for (int i = 0; i < 3; ++i) rows(i) = *entry(first + i, column, values);
    rows = (by * rows).eval();
    for (int i = 0; i < 3; ++i) *entry(first + i, column, values) = rows(i);
  }
}

void Assembler::add_block(int first, const Matrix3& block, std::span<double> values) const {
  if (symmetry_ == Symmetry::symmetric) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) *entry(first + i, first + j, values) += 0.5 * (block(i, j) + block(j, i));
    return;
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) *entry(first + i, first + j, values) += block(i, j);
}

double Assembler::greatest_diagonal() const {
  double greatest = 0.0;
  for (int i = 0; i < model_.dof_count; ++i) greatest = std::max(greatest, std::abs(diagonal(i)));
  return greatest;
}

double Assembler::greatest_stiffness(const VectorX& weight) const {
  double greatest = 0.0;
  const auto consider = [&](int first, int size) {
    if (weight.segment(first, size).maxCoeff() < 1e-290) return;  // a hinge between bodies has no inertia of its own
    double sum = 0.0;
    for (int i = first; i < first + size; ++i) sum += diagonal(i);
    greatest = std::max(greatest, sum / std::max(weight.segment(first, size).sum(), 1e-300));
  };
  for (const int dof : model_.node_dof) consider(dof, model_.dimension);
  for (const int dof : model_.frame_dof) consider(dof, model_.frame_size());
  for (const int dof : model_.edge_dof) consider(dof, 1);
  for (const Hinge& hinge : model_.hinges) consider(hinge.dof, 1);
  for (const Slide& slide : model_.slides) consider(slide.dof, 1);
  return greatest;
}

void Assembler::project(VectorX& vector) const {
  for (const Block& block : blocks_) {
    const Constraint& c = block.constraint;
    vector.segment(c.first, c.size) = (c.free * c.part(vector)).head(c.size);
  }
}

VectorX Assembler::held_part(const VectorX& vector) const {
  VectorX held = vector;
  project(held);
  return vector - held;
}

void Assembler::set_held_part(const VectorX& held, VectorX& vector) const {
  project(vector);
  add_held_part(held, 1.0, vector);
}

void Assembler::add_held_part(const VectorX& from, double factor, VectorX& to) const {
  for (const Block& block : blocks_) {
    const Constraint& c = block.constraint;
    to.segment(c.first, c.size) += factor * c.held(from).head(c.size);
  }
}

void Assembler::add_held_change(const VectorX& from, const VectorX& to, double factor, VectorX& out) const {
  for (const Block& block : blocks_) {
    const Constraint& c = block.constraint;
    out.segment(c.first, c.size) += factor * c.held_change(from, to).head(c.size);
  }
}

double Assembler::greatest_held_change(const VectorX& from, const VectorX& to) const {
  double greatest = 0.0;
  for (const Block& block : blocks_) greatest = std::max(greatest, block.constraint.held_change(from, to).norm());
  return greatest;
}

}  // namespace withe
