/* What happens between the description of a scene and its first step. */
#ifndef HHTDAE_SCENE_START_H
#define HHTDAE_SCENE_START_H

#include "model.h"
#include <petscksp.h>

namespace hhtdae
{

PetscErrorCode ChoosePackage(Mat J, PC pc); /* still.cpp: of a matrix that is factored outside of the integrator */
/* options.cpp */
PetscErrorCode DeclareSceneOptions(); /* option_names.cpp */
PetscErrorCode ReadStartOptions(SceneData &s);
PetscErrorCode ViewStart(const SceneData &s, PetscViewer viewer);
struct Runtime;
/* kept.cpp: an error that names the ranks whose description, up to here, is another one than that of rank 0. Collective, before anything else that is */
PetscErrorCode CompareDescriptions(const SceneData &s, PetscMPIInt size);
PetscErrorCode CheckSame(const Runtime &R, TS ts); /* the same of a run's time, end and tolerances */
PetscErrorCode ViewScene(const Model &M, const Runtime *R, PetscViewer viewer); /* view.cpp; R: a run of it, or null */

/* ---- rows.cpp: all constraints where the description puts the bodies ---- */

/* The rows of one kernel instance; columns are velocity of the centre of mass and angular velocity in space axes, as
   far as the kind of body has them, of the bodies that can move */
struct RowBlock {
  StoreBase            *store;
  PetscInt              instance, element;
  int                   first; /* of its rows among the element's */
  int                   rows;
  unsigned char         active;
  const char           *name;
  bool                  length, holonomic;
  std::vector<PetscInt> body;
  std::vector<int>      column; /* of J, where each body's begin; and their number */
  Eigen::MatrixXd       J;
  Eigen::VectorXd       value, rate, speed; /* Phi, Phi_t (Psi at rest), Phi_q q' + Phi_t (Psi) */

  bool has(int r) const { return active >> r & 1; }
};
enum class Hold { None, Nodes, FixedStart }; /* what counts as ground: nothing, frames that nodes of another library hold, these and bodies with fixed_start */
enum class Modes { Held, Free };      /* modal coordinates: not among the columns, or behind those of their body */

std::vector<RowBlock> DescribeAll(const SceneData &s, double t, Hold hold, Modes modes = Modes::Held);
double                SceneSize(const SceneData &s); /* diagonal of the box around bodies and markers */
double                MechanismSize(const SceneData &s, const std::vector<RowBlock> &blocks); /* of the largest group of bodies that these rows hang together, and of their markers */
std::string           RowName(const SceneData &s, PetscInt element, int row, const char *kernel);

/* Directions of motion of a body: indices among (v, w) */
const std::vector<int> &Directions(BodyKind k);
int                     Width(const SceneData &s, PetscInt body); /* their number, and that of modal coordinates */

/* ---- nearest.cpp: Phi_q M^-1 Phi_q^T, distributed by the owners of the elements; the same blocks, but for their
 * values, in all calls ---- */
class NearestSystem
{
public:
  explicit NearestSystem(Model &m) : M(m) {}
  ~NearestSystem();
  NearestSystem(const NearestSystem &) = delete;
  PetscErrorCode factor(const std::vector<RowBlock> &blocks);
  /* d: 6 numbers a body, the smallest change in the metric of the masses with Phi_q d = rhs (rows of the blocks in
     their order); where `from` is given, nearest to it */
  PetscErrorCode             solve(const std::vector<RowBlock> &blocks, const std::vector<double> &rhs,
                                   const std::vector<double> *from, std::vector<double> &d);
  const std::vector<double> &weights() const { return weight_; } /* Phi_q M^-1 Phi_q^T, diagonal */

private:
  Model                &M;
  std::vector<PetscInt> row_; /* first unknown of blocks */
  std::vector<double>   weight_;
  PetscInt              n_ = 0, start_ = 0;
  Mat                   S_   = nullptr;
  KSP                   ksp_ = nullptr;
  Vec                   b_ = nullptr, x_ = nullptr, all_ = nullptr;
  VecScatter            scatter_ = nullptr;
  bool                  mine(PetscInt row) const { return row >= start_ && row < start_ + n_; }
  PetscErrorCode        number(const std::vector<RowBlock> &blocks);
  PetscErrorCode        assemble(const std::vector<RowBlock> &blocks);
};

/* ---- assemble.cpp ---- */
struct Pose {
  Vector3                             r, v, w;
  Matrix3                             A;
  std::shared_ptr<const FlexibleData> flexible;
};
std::vector<Pose> Poses(const SceneData &s);
void              SetPoses(SceneData &s, const std::vector<Pose> &p);
PetscErrorCode    ReportMoves(SceneData &s, const std::vector<Pose> &before, const char *what);
/* rigid motions of bodies to the constraints of all elements, or of those marked in `part`; ok: within the tolerance */
PetscErrorCode ProjectPositions(Model &M, Hold hold, bool *ok, const std::vector<char> *part = nullptr);
PetscErrorCode Assemble(Model &M); /* reports or projects, as the policy says */
std::vector<char> RigidElements(const SceneData &s, Hold hold); /* those that no flexible body deforms for */
bool           LeftToDeform(const SceneData &s); /* Assemble() has left misfits that flexible bodies have to deform for: the run's first state is to be projected */

/* ---- redundancy.cpp ---- */
PetscErrorCode DropRedundant(Model &M);

/* ---- inertia.cpp: what has no inertia ---- */
void           FillLight(SceneData &s);
PetscErrorCode CheckInertia(const SceneData &s); /* it follows from the constraints */

/* ---- equilibrium.cpp: after Number(), with a layout of its own ---- */
PetscErrorCode FindEquilibrium(const std::shared_ptr<Model> &M);

/* ---- state.cpp: poses, velocities, deformations, variables and states of a run become the initial ones; V null: at rest ---- */
PetscErrorCode WriteState(Model &M, Runtime &R, Vec U, Vec V);

} // namespace hhtdae

#endif
