/* Stress from modal coordinates: von Mises stress at the nodes, and the hot spots of a run without storing its history. */
#include "flexible/body_name.h"
#include "flexible/exchange.h"
#include "hhtdae/flexible.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtdae
{

namespace
{

/* Number of nodes, and of states, whose stress is summed in one block: the sums stay in the second-level cache, while the stress modes, which do not fit into any cache,
   are read once for all states. 500 states of 134 modes at 16,000 nodes take 1.5 s, one state at a time 5.8 s. */
constexpr Eigen::Index node_block = 64, state_block = 16;

double VonMisesOf(const double *s)
{
  const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
  return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

/* Calls each(node, state, von Mises stress) for the states in the columns of eta, at most state_block. Sums over modes have a fixed order, so that a node's stress is the
   same to the last digit whatever its index on a rank. */
template <class Each> void ForEachStress(const StressModes &modes, const Eigen::Ref<const Eigen::MatrixXd> &eta, Each each)
{
  const Eigen::Index nodes = (Eigen::Index)modes.node.size(), states = eta.cols();
  double             sum[state_block][6 * node_block];
  for (Eigen::Index begin = 0; begin < nodes; begin += node_block) {
    const Eigen::Index count = 6 * std::min(node_block, nodes - begin);
    for (Eigen::Index s = 0; s < states; s++) std::fill_n(sum[s], count, 0.0);
    for (Eigen::Index k = 0; k < eta.rows(); k++) {
      const double *column = modes.values.data() + k * modes.values.rows() + 6 * begin;
      for (Eigen::Index s = 0; s < states; s++) {
        const double factor = eta(k, s);
        for (Eigen::Index i = 0; i < count; i++) sum[s][i] += factor * column[i];
      }
    }
    for (Eigen::Index s = 0; s < states; s++)
      for (Eigen::Index i = 0; i < count; i += 6) each(begin + i / 6, s, VonMisesOf(sum[s] + i));
  }
}

PetscErrorCode CheckCoordinates(const ReducedBody &body, const Eigen::VectorXd &eta)
{
  PetscFunctionBegin;
  PetscCheck(eta.size() == body.modal.omega.size(), PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ,
             "%d modal coordinates for the stress of %s with %d modes", (int)eta.size(), BodyName(body).c_str(),
             (int)body.modal.omega.size());
  PetscCheck(eta.allFinite(), PETSC_COMM_SELF, PETSC_ERR_FP,
             "a modal coordinate of %s is not finite: no stress can be told", BodyName(body).c_str());
  PetscCheck(body.stress.node.empty() || (body.stress.values.rows() == 6 * (Eigen::Index)body.stress.node.size() &&
                                          body.stress.values.cols() == eta.size()),
             PETSC_COMM_SELF, PETSC_ERR_ARG_INCOMP, "the stress modes of %s do not fit its nodes and modes",
             BodyName(body).c_str());
  PetscFunctionReturn(0);
}

/* A candidate for a hot spot. It is ahead of another one with lower stress, or with equal stress and a larger label. */
struct Candidate {
  double     stress, time, x[3];
  PetscInt64 label, place; /* place: global number of the node, which decides if labels are equal */
};

bool IsAhead(const Candidate &a, const Candidate &b)
{
  if (a.stress != b.stress) return a.stress > b.stress;
  return a.label != b.label ? a.label < b.label : a.place < b.place;
}

} // namespace

PetscErrorCode VonMises(const ReducedBody &body, const Eigen::VectorXd &eta, std::vector<double> *stress)
{
  PetscFunctionBegin;
  PetscCall(CheckCoordinates(body, eta));
  stress->resize(body.stress.node.size());
  ForEachStress(body.stress, eta, [stress](Eigen::Index i, Eigen::Index, double s) { (*stress)[(std::size_t)i] = s; });
  PetscFunctionReturn(0);
}

/* A stress of -1 means that no state has been evaluated yet */
HotSpots::HotSpots(const ReducedBody &body)
    : body_(body), stress_(body.stress.node.size(), -1.0), time_(body.stress.node.size(), 0.0)
{
}

PetscErrorCode HotSpots::add(double time, const Eigen::VectorXd &eta)
{
  PetscFunctionBegin;
  PetscCall(CheckCoordinates(body_, eta));
  PetscCheck(stress_.size() == body_.stress.node.size(), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONGSTATE,
             "stress modes of %s were changed after its hot spots were begun", BodyName(body_).c_str());
  if (!waiting_) {
    state_.resize(eta.size(), state_block);
    when_.resize(state_block);
  }
  state_.col(waiting_) = eta;
  when_[waiting_++]    = time;
  if (waiting_ == state_block) follow();
  PetscFunctionReturn(0);
}

void HotSpots::follow() const
{
  ForEachStress(body_.stress, state_.leftCols(waiting_), [this](Eigen::Index i, Eigen::Index k, double s) {
    if (s <= stress_[(std::size_t)i]) return;
    stress_[(std::size_t)i] = s;
    time_[(std::size_t)i]   = when_[k];
  });
  waiting_ = 0;
}

/* Repeatedly finds the highest remaining node among the best ones of all ranks, and removes its neighbourhood */
PetscErrorCode HotSpots::highest(PetscInt count, double distance, std::vector<HotSpot> *spots) const
{
  const std::size_t      n = stress_.size();
  std::vector<Candidate> remaining;
  std::vector<Candidate> best;
  PetscMPIInt            size;
  std::string            error;
  PetscInt64             total = 0, mine = (PetscInt64)n;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(body_.comm, &size));
  PetscCallMPI(MPI_Allreduce(&mine, &total, 1, MPIU_INT64, MPI_SUM, body_.comm));
  if (!total)
    error = BodyName(body_) + " has no stress modes: there are no hot spots without AddStressModes()";
  else if (n != body_.stress.node.size() || (waiting_ && state_.rows() != body_.stress.values.cols()))
    error = "stress modes of " + BodyName(body_) + " were changed after its hot spots were begun";
  else if (!(distance >= 0))
    error = "a distance of hot spots is a number from 0 up";
  else if (n &&
           (body_.coordinates.size() != 3 * (std::size_t)body_.own || body_.label.size() != (std::size_t)body_.own))
    error = BodyName(body_) + " has no coordinates of its nodes";
  PetscCall(Agree(body_.comm, error, PETSC_ERR_ARG_WRONG));
  follow();
  for (std::size_t i = 0; i < n; i++) {
    const PetscInt node = body_.stress.node[i];
    const double  *x    = &body_.coordinates[3 * (std::size_t)node];
    if (stress_[i] >= 0)
      remaining.push_back({stress_[i], time_[i], {x[0], x[1], x[2]}, body_.label[(std::size_t)node], body_.first + node});
  }
  spots->clear();
  best.resize((std::size_t)size);
  for (PetscInt k = 0; k < count; k++) {
    Candidate own{-1, 0, {0, 0, 0}, std::numeric_limits<PetscInt64>::max(), 0};
    for (const Candidate &c : remaining)
      if (IsAhead(c, own)) own = c;
    PetscCallMPI(MPI_Allgather(&own, sizeof own, MPI_BYTE, best.data(), sizeof own, MPI_BYTE, body_.comm));
    const Candidate top = *std::min_element(best.begin(), best.end(), IsAhead);
    if (top.stress < 0) break;
    spots->push_back({(PetscInt)top.label, Vector3(top.x[0], top.x[1], top.x[2]), top.stress, top.time});
    remaining.erase(std::remove_if(remaining.begin(), remaining.end(),
                                   [&](const Candidate &c) {
                                     return c.place == top.place ||
                                            std::hypot(c.x[0] - top.x[0], c.x[1] - top.x[1], c.x[2] - top.x[2]) < distance;
                                   }),
                    remaining.end());
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
