#pragma once
/// Stencil -> matrix: the pattern of a model, and where each stencil's numbers go, found once.

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "elasticity/elements.hpp"
#include "elasticity/stencil_kernels.hpp"
#include "solvers/linear_solver.hpp"

namespace withe {

class Assembler;

/// Unknowns and matrix offsets of many stencils of one width. A negative unknown is left out.
class ElementTable {
 public:
  ElementTable() = default;
  ElementTable(int width, std::vector<int> dofs) : width_(width), dofs_(std::move(dofs)) {}

  void find_offsets(const Assembler& assembler);
  int count() const { return width_ == 0 ? 0 : static_cast<int>(dofs_.size()) / width_; }
  int width() const { return width_; }
  const int* dofs(int element) const {
    return dofs_.data() + static_cast<std::size_t>(element) * static_cast<std::size_t>(width_);
  }

  /// True if an element's unknowns follow one another, and so do its numbers in each line of the matrix (columns of
  /// the lower triangle, or whole lines); then where its lines begin.
  bool regular(int element, std::vector<std::ptrdiff_t>& lines) const;

  /// True if a regular element's lines are rows.
  bool by_rows(int element) const { return offset(element, 0, 1) == offset(element, 0, 0) + 1; }

  /// Place of the entry (i, j) of an element's square in the solver's values.
  std::ptrdiff_t offset(int element, int i, int j) const;
  /// residual += scale gradient, magnitude += |gradient|.
  void add_gradient(int element, const double* gradient, double scale, VectorX& residual, VectorX& magnitude) const;
  /// values += scale hessian.
  template <int Stride>
  void add_hessian(int element, const double (&hessian)[Stride][Stride], double scale, std::span<double> values) const {
    add_hessian(element, &hessian[0][0], Stride, scale, values);
  }
  /// The same of a hessian of those unknowns alone that are not left out.
  template <int Stride>
  void add_dense_hessian(int element, const double (&hessian)[Stride][Stride], double scale,
                         std::span<double> values) const {
    add_dense_hessian(element, &hessian[0][0], Stride, scale, values);
  }

 private:
  void add_hessian(int element, const double* hessian, int stride, double scale, std::span<double> values) const;
  void add_dense_hessian(int element, const double* hessian, int stride, double scale, std::span<double> values) const;
  /// Offsets of an element: of the unknowns that are not left out, row after row, or of the lower triangle.
  const int* offsets(int element) const { return offsets_.data() + starts_[static_cast<std::size_t>(element)]; }
  /// Number of an element's first unknowns that are not left out.
  int present(int element, int before) const {
    const int* d = dofs(element);
    return before - static_cast<int>(std::count_if(d, d + before, [](int dof) { return dof < 0; }));
  }

  int width_ = 0;
  bool symmetric_ = true;
  std::vector<int> dofs_;
  std::vector<int> offsets_;  ///< narrow, since reading them takes most of the time of adding a contact
  std::vector<std::ptrdiff_t> starts_;
};

/// A part that a body carries, at one configuration: derivatives of its own unknowns, up to three, by those of the
/// body, and of the rows of the body.
struct Carrying {
  static constexpr int kMost = 7;             ///< unknowns of the body: base, frame and slide
  Eigen::Matrix<double, 3, kMost> follow;     ///< of its unknowns by those of the body
  Eigen::Matrix<double, kMost, 3> act;        ///< of the rows of the body by the forces on the part
  Eigen::Matrix<double, kMost, kMost> slope;  ///< of these rows by the unknowns of the body, with these forces constant
  bool known = false;
};
/// The derivatives of a part; null where they are neither known nor needed.
using CarryingOf = std::function<const Carrying*(std::size_t part, bool needed)>;

/// Ordinary stencils for the kernels of stencil_kernels.hpp, and the other stencils.
struct RegularStencils {
  std::vector<int> stencil, first_unknown, edges;
  std::vector<double> owned;
  std::vector<std::ptrdiff_t> lines;
  bool by_rows = false;          ///< true if lines of an unsymmetric matrix are its rows, else its columns
  std::vector<int> other_bend;   ///< stencils left over
  std::vector<int> other_edges;  ///< edges whose stretching no regular stencil owns
};

/// The matrix of a model with its tables.
class Assembler {
 public:
  /// `declared`: tables of forces besides elasticity, which must outlive it; their offsets follow the solver's.
  Assembler(const Model& model, std::vector<ElementTable*> declared, Symmetry symmetry, SolverKind kind,
            bool exact = false);

  /// Pattern of the solver: without the entries of parts that bodies carry, of which only a diagonal is left.
  const SparsityPattern& pattern() const { return pattern_; }
  /// Place of an entry in the solver's values: an entry of a carried part is beside the matrix.
  std::ptrdiff_t place(int row, int column) const;
  LinearSolver& solver() { return *solver_; }
  const LinearSolver& solver() const { return *solver_; }
  /// Threads that share the work of this and all later solvers; null: none.
  void share_work(WorkerPool* workers) {
    workers_ = workers;
    solver_->share_work(workers);
  }
  /// Places of the diagonal in the solver's values, per unknown.
  const std::vector<std::ptrdiff_t>& diagonal_offsets() const { return diagonal_; }
  double diagonal(int dof) const {
    return solver_->values()[static_cast<std::size_t>(diagonal_[static_cast<std::size_t>(dof)])];
  }

  /// The entry of row i and column j in the solver's values, or null.
  double* entry(int row, int column, std::span<double> values) const;
  /// Three rows, from `first` on, times a matrix. Unsymmetric matrices only.
  void turn_rows(int first, const Matrix3& by, std::span<double> values) const;
  /// Adds a block on the diagonal; of a symmetric matrix its symmetric part.
  void add_block(int first, const Matrix3& block, std::span<double> values) const;

  /// out = A x or A^T x with the solver's values; exact matrices only. `multiply_held` uses held unknowns only.
  void multiply(const VectorX& x, VectorX& out) const;
  void multiply_transposed(const VectorX& x, VectorX& out) const;
  void multiply_held_transposed(const VectorX& x, VectorX& out) const;

  double greatest_diagonal() const;
  /// Greatest mean of the diagonal entries of a node or frame, or greatest entry of an angle, over that of `weight`. It
  /// does not depend on the orientation of the scene in space.
  double greatest_stiffness(const VectorX& weight) const;

  /// Adds the unknowns of contacts, one after the other (-1: none). If they couple unknowns that were not coupled, it
  /// finds a new order of elimination, and the solver is a new one.
  void couple(const std::vector<int>& contact_unknowns, int width);
  /// Couples the unknowns of contacts, with an order of elimination for these contacts and no others.
  void order_for(const std::vector<int>& contact_unknowns, int width);
  /// Adds groups of unknowns that custom forces couple, if they are not coupled yet.
  void couple_groups(const std::vector<std::vector<int>>& groups);
  /// These and no others.
  void set_groups(const std::vector<std::vector<int>>& groups);
  const std::vector<std::vector<int>>& groups() const { return groups_; }
  /// Another number whenever the solver is.
  int generation() const { return generation_; }

  /// Adds the rows and columns of parts that bodies carry, which lie beside the matrix, to those of their bodies. In
  /// the matrix they have a positive diagonal alone.
  void fold_carried(const CarryingOf& carrying_of);

  /// Removes held unknowns: rows and columns are projected onto the free directions. Held directions get a positive
  /// diagonal, so that the pattern stays and held increments vanish.
  void project_matrix();
  /// Project the matrix until it is restored, see above.
  void project_for_now();
  void take_back_projection();
  void project(VectorX& vector) const;
  /// The part of a vector along held directions.
  VectorX held_part(const VectorX& vector) const;
  /// Replaces the held part by that of another vector; `held` may be empty if nothing is held.
  void set_held_part(const VectorX& held, VectorX& vector) const;
  /// to += factor x the part of `from` along held directions.
  void add_held_part(const VectorX& from, double factor, VectorX& to) const;
  /// out += factor x the part of `to` - `from` along held directions.
  void add_held_change(const VectorX& from, const VectorX& to, double factor, VectorX& out) const;
  /// Length of the longest of those parts, one per constraint.
  double greatest_held_change(const VectorX& from, const VectorX& to) const;

  ElementTable stretch, bend, half, contact;
  RegularStencils regular;
  /// Places of a node's own entries per edge and direction, and of the one or (unsymmetric) two entries between them.
  std::vector<std::ptrdiff_t> edge_couplings;

 private:
  struct Coupling {
    std::ptrdiff_t offset[3];
    bool diagonal_block;
  };
  struct Block {
    Constraint constraint;
    std::vector<Coupling> rows, columns;
    std::ptrdiff_t own[3][3];
  };
  void analyse();
  /// Places of the entries that a carried part moves: of its own unknowns, those of its body, and all others that are
  /// coupled with it. -1: there is none.
  struct Fold {
    int own = 0, body = 0, others = 0;  ///< numbers of unknowns
    /// Row after row: own x others, body x others, and (unsymmetric) others x own, others x body.
    std::vector<std::ptrdiff_t> rows, onto_rows, columns, onto_columns;
    std::vector<std::ptrdiff_t> square;    ///< (own, body) x (own, body)
    std::vector<std::ptrdiff_t> diagonal;  ///< of its own unknowns in the matrix
  };
  /// `before(place)`: called before an entry is changed.
  template <class Before>
  void project_matrix(const Before& before);
  double transposed_row(int column, const VectorX& x) const;
  void find_blocks();
  void find_folds();
  void add_bodies_to(std::vector<std::vector<int>>& cliques) const;
  /// Takes carried unknowns out of the pattern, and numbers their entries.
  void set_beside();
  bool carried(int dof) const { return !carried_.empty() && carried_[static_cast<std::size_t>(dof)] >= 0; }
  /// The pattern with the entries of carried parts.
  const SparsityPattern& whole_pattern() const { return carried_.empty() ? pattern_ : whole_; }
  void find_edge_couplings();

  const Model& model_;
  Symmetry symmetry_;
  SolverKind kind_;
  std::vector<ElementTable*> declared_;
  bool exact_;
  int generation_ = 0;
  std::vector<std::vector<int>> cliques_;  ///< without contact and custom forces
  std::vector<std::vector<int>> groups_;   ///< groups of custom forces
  SparsityPattern pattern_;
  std::unique_ptr<LinearSolver> solver_;
  WorkerPool* workers_ = nullptr;
  std::vector<std::ptrdiff_t> diagonal_;
  std::vector<std::ptrdiff_t> entries_;  ///< entries of the pattern, one after the other; exact matrices only
  std::vector<Block> blocks_;
  std::vector<Fold> folds_;
  std::vector<int> carried_;            ///< per unknown its part, or -1; empty without bodies
  SparsityPattern whole_;               ///< with the entries of carried parts, if there are any
  std::vector<std::ptrdiff_t> beside_;  ///< per entry of `whole_`: its place, if a carried part has it, or -1
  std::vector<std::pair<std::size_t, double>> replaced_;  ///< entries that a projection has changed
};

}  // namespace withe
