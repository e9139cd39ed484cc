/*
  Small motions in minimal coordinates, by dense linear algebra; every rank makes the whole computation.

  Accelerations and algebraic unknowns follow from positions q, velocities v, first-order states s and inputs f by the differentiated
  constraints; a dot marks rates of their rows along the motion:

    W (q'', s', lambda, V, F) = b f - K_q q - C_q v - K_s s,    rows of constraints: Phi_q q'' = -2 Phi_q. v - Phi_q.. q,
                                                                Psi_v q'' = -(Psi_v. + Psi_q) v - Psi_q. q - Psi_s s' - Psi_s. s

  Variables that rows at velocity level read are eliminated beforehand, row_rates.cpp.

  Positions are q = N z, N an orthonormal basis of the null space of Phi_q; velocities v = L y + P q + S s, L an orthonormal
  basis of the null space of Phi_q and Psi_v, P and S the minimum-norm solutions of Phi_q v = -Phi_q. q, Psi_v v = -Psi_q q -
  Psi_s s. If the rows change along the motion, N and L change with the smallest possible rates: their columns undergo
  parallel transport, so that the coordinate of a single degree of freedom is the arc length of its path, in the metric of the
  masses, at any speed. The equations are

    z' = N^T v,    y' = L^T q'' + L.^T (P q + S s),    s' as above.

  That is the arc length as long as masses stay 1 in the axes of the linearization. The inertia of a body that turns in these axes
  changes, and with it m = N^T M N, the metric of the masses on the columns of N. The states that are handed out are therefore R z,
  with R R = m, and their rates (InUnitsOfMass()).

  The computation uses coordinates for which masses are 1 (Work::unit), and rows of constraints of norm 1. In metres, radians
  and modal coordinates, whose magnitudes differ the more the smaller the bodies are, orthonormal bases would lose digits
  (SmallBodies.StateSpace).
*/
#include "complement.h"
#include "linearization.h"
#include "products.h"
#include <Eigen/Core>
#include <petscblaslapack.h>
#include <algorithm>
#include <numeric>

namespace hhtdae
{

namespace
{

using Dense   = Eigen::MatrixXd;
using Complex = std::complex<double>;

constexpr PetscInt max_dense_unknowns = 1000; /* all modes then take about a minute */

/* Gathers the own entries of all ranks on every rank */
template <class T> PetscErrorCode Gather(const Linearization::Work &w, MPI_Datatype type, const std::vector<T> &own, std::vector<T> &all)
{
  std::vector<PetscMPIInt> count(w.R->size), first(w.R->size, 0);
  const PetscMPIInt        n = (PetscMPIInt)own.size();
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, count.data(), 1, MPI_INT, w.comm()));
  for (int r = 1; r < w.R->size; r++) first[r] = first[r - 1] + count[r - 1];
  all.resize(first.back() + count.back());
  PetscCallMPI(MPI_Allgatherv(own.data(), n, type, all.data(), count.data(), first.data(), type, w.comm()));
  PetscFunctionReturn(0);
}

/* Submatrix of A */
Dense Block(const Dense &A, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &columns)
{
  Dense B(rows.size(), columns.size());
  for (std::size_t i = 0; i < rows.size(); i++)
    for (std::size_t j = 0; j < columns.size(); j++) B((Eigen::Index)i, (Eigen::Index)j) = A(rows[i], columns[j]);
  return B;
}

/* The x of minimum norm with A x = b for each column of b, and the rank of A. By LAPACK, because Eigen's decompositions take seconds to compile */
Dense MinimumNormSolution(Dense A, const Dense &b, PetscBLASInt *rank)
{
  const PetscBLASInt  m = (PetscBLASInt)A.rows(), n = (PetscBLASInt)A.cols(), k = (PetscBLASInt)b.cols(), longer = PetscMax(m, n);
  const PetscBLASInt  size = 64 * (m + n) + k;
  const double        least = PETSC_MACHINE_EPSILON * (double)PetscMin(m, n); /* singular values below this part of the largest one count as 0 */
  std::vector<double> singular(PetscMin(m, n) + 1), work(size);
  PetscBLASInt        info = 0;
  Dense               x = Dense::Zero(longer, k);
  x.topRows(m) = b;
  LAPACKgelss_(&m, &n, &k, A.data(), &m, x.data(), &longer, singular.data(), &least, rank, work.data(), &size, &info);
  if (info) *rank = 0;
  return x.topRows(n);
}

/* Rows of constraints, scaled to norm 1, with an orthonormal basis `free` of their null space; least(b): the x of minimum norm with A x = b for the unscaled rows */
struct ConstraintRows {
  Dense           A, free, inverse;
  Eigen::VectorXd scale;
  PetscBLASInt    rank = 0;

  explicit ConstraintRows(const Dense &rows) : A(rows), scale(rows.rows())
  {
    const Eigen::Index n = A.cols(), m = A.rows();
    if (!m) {
      free = Dense::Identity(n, n);
      return;
    }
    for (Eigen::Index i = 0; i < m; i++) {
      const double norm = A.row(i).norm();
      /* no conditional expression, since vectorized code might divide by zero in the branch that is not taken and cause a
         floating-point trap */
      scale(i)          = 1 / (norm + (double)(norm == 0));
      A.row(i) *= scale(i);
    }
    if (m <= n) free = OrthogonalComplement(A.transpose()); /* else the rows are dependent */
    inverse = MinimumNormSolution(A, Dense::Identity(m, m), &rank);
  }
  bool  independent() const { return rank == A.rows(); }
  Dense least(const Dense &b) const { return A.rows() ? Dense(inverse * (scale.asDiagonal() * b)) : Dense::Zero(A.cols(), b.cols()); }
};

struct Minimal {
  std::vector<PetscInt> q, holonomic, velocity, s, algebraic; /* global numbers; algebraic: multipliers of constraints, then variables and force states */
  Eigen::VectorXd       unit;                                 /* units of all unknowns; the matrices below are in these units */
  Dense                N, L, P, S;
  Dense                y; /* (q'', s', rest) from (z, y, s, f) */
  Dense                A, B;
  Dense                original; /* (z, y, s, f) above from the states that are handed out and inputs */
  Eigen::Index          dz() const { return N.cols(); }
  Eigen::Index          dy() const { return L.cols(); }
  Eigen::Index          ds() const { return (Eigen::Index)s.size(); }
  Eigen::Index          states() const { return dz() + dy() + ds(); }
};

/* Solves W x = right after scaling the largest entries of rows and columns to 1; NaN if W is singular */
Dense SolveEquilibrated(Dense W, Dense right)
{
  Eigen::VectorXd row(W.rows()), column(W.cols());
  for (Eigen::Index i = 0; i < W.rows(); i++) {
    const double x = W.row(i).cwiseAbs().maxCoeff();
    row(i)         = x > 0 ? 1 / x : 1;
  }
  W     = row.asDiagonal() * W;
  right = row.asDiagonal() * right;
  for (Eigen::Index j = 0; j < W.cols(); j++) {
    const double x = W.col(j).cwiseAbs().maxCoeff();
    column(j)      = x > 0 ? 1 / x : 1;
  }
  W = W * column.asDiagonal();
  const PetscBLASInt        n = (PetscBLASInt)W.rows(), k = (PetscBLASInt)right.cols(), leading = PetscMax(n, 1);
  std::vector<PetscBLASInt> pivot(leading);
  PetscBLASInt              info = 0;
  LAPACKgesv_(&n, &k, W.data(), &leading, pivot.data(), right.data(), &leading, &info);
  if (info) right.setConstant(NAN);
  return column.asDiagonal() * right;
}

/* The metric of the masses on the columns of a basis X, m = X^T M X, and its first and second rates m1 and m2 by those of X and M */
struct BasisMetric {
  Dense m, m1, m2;

  BasisMetric(const Dense &X, const Dense &X1, const Dense &X2, const Dense &M, const Dense &M1, const Dense &M2)
  {
    const auto twice = [](const Dense &A) { return Dense(A + A.transpose()); };
    m  = X.transpose() * M * X;
    m1 = twice(X1.transpose() * M * X) + X.transpose() * M1 * X;
    m2 = twice(X2.transpose() * M * X + 2 * X1.transpose() * M1 * X) + 2 * X1.transpose() * M * X1 + X.transpose() * M2 * X;
  }
};

/* The symmetric square root R of a metric m, and its rates by R R' + R' R = m' and R R'' + R'' R = m'' - 2 R' R' */
struct Root {
  Dense R, R1, R2;

  /* Directions with eigenvalues of m below `least` times the largest one, such as the rotation of a thin rod about its axis, keep a constant
     length: the eigenvalue may be rounding, and its rates would be divided by its root (Linearize.AThinRodOnABallJoint). */
  explicit Root(const BasisMetric &metric)
  {
    constexpr double    least = 1e-5;
    const PetscBLASInt  n = (PetscBLASInt)metric.m.rows(), leading = PetscMax(n, 1), size = 64 * leading;
    Dense               V = metric.m, sums(n, n);
    Eigen::VectorXd     root(n);
    std::vector<double> work(size);
    PetscBLASInt        info = 0;
    LAPACKsyev_("V", "U", &n, V.data(), &leading, root.data(), work.data(), &size, &info);
    if (info) root.setConstant(NAN);
    const double smallest = n ? least * root(n - 1) : 0;
    const auto   keeps    = [&](PetscBLASInt k) { return !(V.col(k).dot(metric.m * V.col(k)) > smallest); };
    for (PetscBLASInt k = 0; k < n; k++) root(k) = std::sqrt(std::max(root(k), smallest));
    for (PetscBLASInt k = 0; k < n; k++)
      for (PetscBLASInt i = 0; i < n; i++) sums(i, k) = keeps(i) || keeps(k) ? INFINITY : root(i) + root(k);
    const auto solve = [&](const Dense &right) { return Dense(V * (V.transpose() * right * V).cwiseQuotient(sums) * V.transpose()); };
    R  = V * root.asDiagonal() * V.transpose();
    R1 = solve(metric.m1);
    R2 = solve(metric.m2 - 2 * R1 * R1);
  }
};

/* Scales the matrices to units in which masses are 1 and rows of constraints have norm 1, with corresponding multipliers;
   scales the rates of these rows, too */
void ToUnits(Minimal &m, Dense &M, Dense &C, Dense &K, const std::vector<PetscInt> &constraints, RowRates &rates)
{
  for (Dense *X : {&M, &C, &K}) *X = m.unit.asDiagonal() * *X * m.unit.asDiagonal();
  Eigen::VectorXd row = Eigen::VectorXd::Ones(m.unit.size());
  for (const auto *rows : {&m.holonomic, &m.velocity})
    for (PetscInt i : *rows) {
      const double length = Block(rows == &m.holonomic ? K : C, {i}, m.q).norm();
      row(i)              = length > 0 ? 1 / length : 1;
    }
  for (Dense *X : {&M, &C, &K}) *X = row.asDiagonal() * *X * row.asDiagonal();
  m.unit.array() *= row.array();
  for (Dense *X : {&rates.M, &rates.second_M}) *X = m.unit.asDiagonal() * *X * m.unit.asDiagonal();
  for (Dense *X : {&rates.C, &rates.K, &rates.second_K})
    for (Eigen::Index i = 0; i < X->rows(); i++) X->row(i) = m.unit(constraints[i]) * X->row(i) * m.unit.asDiagonal();
}

/* Replaces the states (z, y, s) by X (z, y, s) = (w, E w', s), where w = R z has the length of the metric of the masses, R R = N^T M N at all
   times. E expresses rates of w in the directions L that constraints on velocities leave; without such constraints it is 1, and the second
   states are the rates of the first. Then A becomes X' X^{-1} + X A X^{-1}. across: L^T M N */
PetscErrorCode InUnitsOfMass(MPI_Comm comm, Minimal &m, Eigen::Index inputs, const Root &z, const Root &y, const Dense &across)
{
  const Eigen::Index nz = m.dz(), ny = m.dy(), n = m.states();
  const Dense        E = SolveEquilibrated(y.R, SolveEquilibrated(z.R, across.transpose()).transpose());
  Dense              X = Dense::Identity(n, n), X1 = Dense::Zero(n, n);
  PetscFunctionBegin;
  X.topLeftCorner(nz, nz)  = z.R;
  X.block(nz, 0, ny, nz)   = E * z.R1;
  X.block(nz, nz, ny, ny)  = y.R;
  X1.topLeftCorner(nz, nz) = z.R1;
  X1.block(nz, 0, ny, nz)  = E * z.R2;
  X1.block(nz, nz, ny, ny) = y.R1;
  const Dense back         = SolveEquilibrated(X, Dense::Identity(n, n));
  PetscCheck(back.allFinite(), comm, PETSC_ERR_MAT_LU_ZRPVT, "Linearization: the mass matrix is singular in directions that the constraints leave free");
  m.A                            = (X1 + X * m.A) * back;
  m.B                            = X * m.B;
  m.original                     = Dense::Identity(n + inputs, n + inputs);
  m.original.topLeftCorner(n, n) = back;
  PetscFunctionReturn(0);
}

PetscErrorCode Reduce(const Linearization::Work &w, const std::vector<Excitation> &in, Minimal &m)
{
  Dense                     M, C, K;
  std::vector<unsigned char> role;
  std::vector<double>        unit;
  PetscInt                   n;
  PetscFunctionBegin;
  PetscCall(MatGetSize(w.M, &n, nullptr));
  PetscCheck(n <= max_dense_unknowns, w.comm(), PETSC_ERR_ARG_OUTOFRANGE, "Linearization: %" PetscInt_FMT " unknowns are too many for dense algebra (%" PetscInt_FMT "); SlowestModes() and response() are sparse", n, max_dense_unknowns);
  PetscCall(GatherDense(w.M, M));
  PetscCall(GatherDense(w.C, C));
  PetscCall(GatherDense(w.K, K));
  PetscCall(Gather(w, MPI_UNSIGNED_CHAR, w.role, role));
  PetscCall(Gather(w, MPI_DOUBLE, w.unit, unit));
  std::vector<PetscInt> definitions, variables;
  for (PetscInt i = 0; i < n; i++)
    (role[i] == TSHHT3_COORDINATE ? m.q : role[i] == TSHHT3_STATE ? m.s : role[i] == TSHHT3_HOLONOMIC ? m.holonomic : role[i] == TSHHT3_NONHOLONOMIC ? m.velocity : definitions).push_back(i);
  for (PetscInt i : definitions)
    if (role[i] == TSHHT3_VARIABLE) variables.push_back(i);
  m.algebraic = m.holonomic;
  m.algebraic.insert(m.algebraic.end(), m.velocity.begin(), m.velocity.end());
  m.algebraic.insert(m.algebraic.end(), definitions.begin(), definitions.end());
  m.unit = Eigen::Map<const Eigen::VectorXd>(unit.data(), n);
  std::vector<PetscInt> both = m.holonomic;
  both.insert(both.end(), m.velocity.begin(), m.velocity.end());
  RowRates rates;
  PetscCall(w.rates(both, variables, &rates));
  EliminateVariables(m.velocity, variables, C, K);
  for (PetscInt i : m.velocity)
    PetscCheck(std::all_of(m.algebraic.begin(), m.algebraic.end(), [&](PetscInt j) { return K(i, j) == 0; }), w.comm(), PETSC_ERR_SUP,
               "Linearization: %s reads a variable that does not follow from positions, velocities, states and time", UnknownName(*w.R->model, i).c_str());
  ToUnits(m, M, C, K, both, rates);

  const ConstraintRows position(Block(K, m.holonomic, m.q));
  const Eigen::Index h = (Eigen::Index)m.holonomic.size(), nr = (Eigen::Index)both.size();
  const auto         rate = [&](const Dense &X, const std::vector<PetscInt> &columns) {
    std::vector<PetscInt> all(nr);
    std::iota(all.begin(), all.end(), 0);
    return Block(X, all, columns);
  };
  Dense of_v(nr, m.q.size()), of_q(nr, m.q.size()), of_s = Dense::Zero(nr, m.ds()), of_v_rate = rate(rates.C, m.q);
  of_v << Block(K, m.holonomic, m.q), Block(C, m.velocity, m.q);
  of_v_rate.topRows(h) = rate(rates.K, m.q).topRows(h);
  of_q << of_v_rate.topRows(h), Block(K, m.velocity, m.q);
  of_s.bottomRows(nr - h) = Block(K, m.velocity, m.s);
  const ConstraintRows motion(of_v);
  PetscCheck(position.independent() && motion.independent(), w.comm(), PETSC_ERR_MAT_LU_ZRPVT, "Linearization: the constraints depend on one another in this position, where the number of degrees of freedom is not defined");
  m.N = position.free;
  m.L = motion.free;
  m.P = motion.least(-of_q);
  m.S = motion.least(-of_s);

  /* W, and the right-hand side for (q, v, s, f) */
  std::vector<PetscInt> rows(n);
  std::iota(rows.begin(), rows.end(), 0);
  const Eigen::Index nq = (Eigen::Index)m.q.size(), ns = m.ds(), nf = (Eigen::Index)in.size();
  Dense             W(n, n), right(n, 2 * nq + ns + nf);
  W << Block(M, rows, m.q), Block(C, rows, m.s), Block(K, rows, m.algebraic);
  right << -Block(K, rows, m.q), -Block(C, rows, m.q), -Block(K, rows, m.s), Dense::Zero(n, nf);
  for (Eigen::Index f = 0; f < nf; f++) {
    std::vector<double> own, all;
    PetscCall(w.load(in[f], &own));
    PetscCall(Gather(w, MPI_DOUBLE, own, all));
    for (PetscInt i = 0; i < n; i++) right(i, 2 * nq + ns + f) = m.unit(i) * all[i];
    for (PetscInt i : both)
      PetscCheck(all[i] == 0, w.comm(), PETSC_ERR_SUP,
                 "Linearization::stateSpace(): input %d is a motion of a displacement or velocity, whose derivatives would be inputs, too: make it one of an acceleration, "
                 "or ask response()", (int)f);
  }
  const Dense of_v_second = of_v_rate + of_q, of_q_second = rate(rates.K, m.q), of_s_second = rate(rates.K, m.s), second = rate(rates.second_K, m.q);
  for (Eigen::Index k = 0; k < nr; k++) {
    const PetscInt i = both[k];
    W.row(i) << of_v.row(k), of_s.row(k), Dense::Zero(1, n - nq - ns);
    right.row(i) << -(k < h ? second : of_q_second).row(k), -of_v_second.row(k), -(double)(k >= h) * of_s_second.row(k), Dense::Zero(1, nf);
  }
  Dense expand = Dense::Zero(2 * nq + ns + nf, m.states() + nf);
  expand.block(0, 0, nq, m.dz())                       = m.N;
  expand.block(nq, 0, nq, m.dz())                      = m.P * m.N;
  expand.block(nq, m.dz(), nq, m.dy())                 = m.L;
  expand.block(nq, m.dz() + m.dy(), nq, ns)            = m.S;
  expand.bottomRightCorner(ns + nf, ns + nf).setIdentity();
  m.y = SolveEquilibrated(W, right * expand);
  PetscCheck(m.y.allFinite(), w.comm(), PETSC_ERR_MAT_LU_ZRPVT, "Linearization: accelerations and multipliers do not follow from the state: the constraints are singular there");

  Dense       result(m.states(), m.states() + nf), nonminimal_velocity = expand.middleRows(nq, nq);
  const Dense turn = motion.least(-of_v_rate * m.L);
  nonminimal_velocity.middleCols(m.dz(), m.dy()).setZero();
  result << m.N.transpose() * expand.middleRows(nq, nq), m.L.transpose() * m.y.topRows(nq) + turn.transpose() * nonminimal_velocity, m.y.middleRows(nq, ns);
  m.A = result.leftCols(m.states());
  m.B = result.rightCols(nf);

  const Dense mass = Block(M, m.q, m.q), mass_rate = Block(rates.M, m.q, m.q), N1 = position.least(-of_v_rate.topRows(h) * m.N);
  const Dense N2 = position.least(-2 * of_v_rate.topRows(h) * N1 - second.topRows(h) * m.N) - m.N * (N1.transpose() * N1);
  const BasisMetric positions(m.N, N1, N2, mass, mass_rate, Block(rates.second_M, m.q, m.q)), velocities(m.L, turn, Dense::Zero(nq, m.dy()), mass, mass_rate, Dense::Zero(nq, nq));
  PetscCall(InUnitsOfMass(w.comm(), m, nf, Root(positions), Root(velocities), m.L.transpose() * mass * m.N));
  PetscFunctionReturn(0);
}

/* x, x', x'' of own unknowns from states and inputs */
template <class T> void Unknowns(const Linearization::Work &w, const Minimal &m, const Eigen::Matrix<T, Eigen::Dynamic, 1> &given, std::array<std::vector<T>, 3> &x)
{
  using Vector          = Eigen::Matrix<T, Eigen::Dynamic, 1>;
  const PetscInt start  = w.R->start, n = w.R->n;
  const Vector   state  = m.original * given;
  const Vector   z = state.head(m.dz()), y = state.segment(m.dz(), m.dy()), s = state.segment(m.dz() + m.dy(), m.ds());
  const Vector   q = m.N * z, v = m.L * y + m.P * q + m.S * s, other = m.y * state;
  for (auto &c : x) c.assign(n, 0);
  auto put = [&](int order, PetscInt i, T value) {
    if (i >= start && i < start + n) x[order][i - start] = m.unit(i) * value;
  };
  for (std::size_t k = 0; k < m.q.size(); k++) {
    put(0, m.q[k], q((Eigen::Index)k));
    put(1, m.q[k], v((Eigen::Index)k));
    put(2, m.q[k], other((Eigen::Index)k));
  }
  for (std::size_t k = 0; k < m.s.size(); k++) {
    put(0, m.s[k], s((Eigen::Index)k));
    put(1, m.s[k], other((Eigen::Index)(m.q.size() + k)));
  }
  for (std::size_t k = 0; k < m.algebraic.size(); k++) put(0, m.algebraic[k], other((Eigen::Index)(m.q.size() + m.s.size() + k)));
}

/* Whether a complex pair is a double root zero, of a motion that nothing drives back. Rounding splits it into such a pair or into two real roots: the square of the value is then what
   it leaves of the sum of the accelerations by the displacement x (Steady.test_free_driveline). */
bool IsRoundingOfZero(const Minimal &m, Complex value, const Eigen::VectorXcd &x)
{
  constexpr double      roundings = 100;
  const Eigen::VectorXd z         = x.head(m.dz()).cwiseAbs();
  const double          sum       = (m.A.block(m.dz(), 0, m.dy(), m.dz()).cwiseAbs() * z).norm();
  return std::norm(value) * z.norm() < roundings * PETSC_MACHINE_EPSILON * sum;
}

/* Eigenvalues with non-negative imaginary parts, and their vectors; double roots zero twice. LAPACK balances A; without balancing slow modes would
   be lost, because A has entries of order 1 for rates of positions and entries of the order of stiffness over mass for
   rates of velocities, up to 1e15 in a steel part of 1 mm (SmallBodies.Modes). */
PetscErrorCode Eigenpairs(MPI_Comm comm, const Minimal &m, std::vector<Complex> *value, Eigen::MatrixXcd *vector)
{
  Dense              A = m.A;
  const PetscBLASInt n = (PetscBLASInt)A.rows(), one = 1, ask = -1;
  Eigen::VectorXd    re(n), im(n);
  Dense              V(n, n);
  double             none = 0, best = 0;
  PetscBLASInt       info = 0;
  PetscFunctionBegin;
  LAPACKgeev_("N", "V", &n, A.data(), &n, re.data(), im.data(), &none, &one, V.data(), &n, &best, &ask, &info);
  std::vector<double> work((std::size_t)best);
  const PetscBLASInt  size = (PetscBLASInt)work.size();
  LAPACKgeev_("N", "V", &n, A.data(), &n, re.data(), im.data(), &none, &one, V.data(), &n, work.data(), &size, &info);
  PetscCheck(!info, comm, PETSC_ERR_CONV_FAILED, "Linearization::modes(): the eigenvalues of the matrix of %d states were not found", (int)n);
  value->clear();
  vector->resize(n, n);
  for (Eigen::Index k = 0; k < n; k++) {
    if (im(k) < 0) continue; /* the conjugate of the eigenvalue before it */
    vector->col((Eigen::Index)value->size()) = V.col(k);
    if (im(k) > 0) vector->col((Eigen::Index)value->size()) += Complex(0, 1) * V.col(k + 1);
    if (im(k) > 0 && IsRoundingOfZero(m, {re(k), im(k)}, vector->col((Eigen::Index)value->size()))) {
      for (int twice = 0; twice < 2; twice++) {
        vector->col((Eigen::Index)value->size()) = V.col(k);
        value->push_back(0);
      }
      continue;
    }
    value->push_back({re(k), im(k)});
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode Linearization::modes(std::vector<Mode> *all) const
{
  const Work          &w = *work_;
  Minimal              m;
  std::vector<Complex> value;
  Eigen::MatrixXcd     vector;
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::modes()"));
  PetscCall(Reduce(w, {}, m));
  all->clear();
  if (!m.states()) PetscFunctionReturn(0); /* no degrees of freedom */
  PetscCall(Eigenpairs(w.comm(), m, &value, &vector));
  std::vector<int> order(value.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return std::abs(value[a]) < std::abs(value[b]); });
  for (int k : order) {
    Mode                                 mode;
    std::array<std::vector<Complex>, 3>  x;
    Unknowns<Complex>(w, m, vector.col(k), x);
    mode.value = value[k];
    mode.shape = x[0];
    PetscCall(normalize(&mode));
    all->push_back(mode);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::stateSpace(const std::vector<Excitation> &in, const std::vector<Measure> &out, StateSpace *s) const
{
  const Work &w = *work_;
  Minimal     m;
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::stateSpace()"));
  PetscCall(Reduce(w, in, m));
  const Eigen::Index n = m.states(), nf = (Eigen::Index)in.size(), no = (Eigen::Index)out.size();
  Dense             CD(no, n + nf);
  for (Eigen::Index k = 0; k < n + nf; k++) {
    SmallMotion x;
    double      largest;
    Unknowns<double>(w, m, Eigen::VectorXd::Unit(n + nf, k), x);
    PetscCall(w.displacement({x[0].begin(), x[0].end()}, &largest));
    for (Eigen::Index o = 0; o < no; o++) PetscCall(w.derivative(out[o], x, largest, &CD(o, k)));
  }
  auto rows = [](const Dense &X) {
    std::vector<double> y;
    for (Eigen::Index i = 0; i < X.rows(); i++)
      for (Eigen::Index j = 0; j < X.cols(); j++) y.push_back(X(i, j));
    return y;
  };
  *s = {(PetscInt)n, (PetscInt)nf, (PetscInt)no, rows(m.A), rows(m.B), rows(CD.leftCols(n)), rows(CD.rightCols(nf))};
  PetscFunctionReturn(0);
}

} // namespace hhtdae
