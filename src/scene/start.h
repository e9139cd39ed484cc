/* Preparation of a scene between its description and the first step: options, assembly, redundancy, inertia, equilibrium. */
#ifndef HHTDAE_SCENE_START_H
#define HHTDAE_SCENE_START_H

#include "model.h"
#include <petscksp.h>

namespace hhtdae
{

PetscErrorCode ChoosePackage(Mat J, PC pc); /* still.cpp: solver package for matrices that are factored outside of the integrator */
/* options.cpp */
PetscErrorCode DeclareSceneOptions(); /* option_names.cpp */
PetscErrorCode ReadStartOptions(SceneData &s);
PetscErrorCode ViewStart(const SceneData &s, PetscViewer viewer);
struct Runtime;
/* kept.cpp: an error that names the ranks whose description differs from that of rank 0. Collective; called before any
   other collective work on the description */
PetscErrorCode CompareDescriptions(const SceneData &s, PetscMPIInt size);
PetscErrorCode RestartAfterChange(Runtime &R, TS ts);                           /* continue.cpp: where parameters have been set since the end of the last Scene::solve() */
PetscErrorCode CheckSame(const Runtime &R, TS ts);                              /* an error if time, final time or tolerances of a run differ between ranks */
PetscErrorCode ViewScene(const Model &M, const Runtime *R, PetscViewer viewer); /* view.cpp; R: a run of it, or null */

/* ---- rows.cpp: all constraints at the described poses ---- */

/* The rows of one kernel instance. The columns of J are the directions of motion, Directions(), of the movable bodies:
   velocity of the centre of mass and angular velocity in space axes */
struct RowBlock {
  StoreBase            *store;
  PetscInt              instance, element;
  int                   first; /* number of its first row among the element's rows */
  int                   rows;
  unsigned char         active;
  const char           *name;
  bool                  length, holonomic;
  std::vector<PetscInt> body;
  std::vector<int>      column; /* first column of each body in J; the last entry is the number of columns */
  Eigen::MatrixXd       J;
  Eigen::VectorXd       value, rate, speed; /* Phi, Phi_t, Phi_q q' + Phi_t; at velocity level 0, Psi at rest, Psi */

  bool has(int r) const { return active >> r & 1; }
};
/* Bodies that must not be moved: none; frames at nodes of extensions; these frames and bodies with fixed_start */
enum class FixedBodies { None, Nodes, FixedStart };
/* Whether a body's columns include its modal coordinates, after the others */
enum class ModalColumns { None, Included };

std::vector<RowBlock> DescribeAll(const SceneData &s, double t, FixedBodies fixed_bodies, ModalColumns modes = ModalColumns::None);
double                SceneSize(const SceneData &s); /* diagonal of the box around bodies and markers */
/* size of the largest group of bodies that these rows connect, including the markers of the rows */
double                MechanismSize(const SceneData &s, const std::vector<RowBlock> &blocks);
std::string           RowName(const SceneData &s, PetscInt element, int row, const char *kernel);

/* Directions of motion of a body, as indices into (v, w) */
const std::vector<int> &Directions(BodyKind k);
int                     Width(const SceneData &s, PetscInt body); /* number of a body's directions of motion and modal coordinates */

/* ---- nearest.cpp: solves systems with Phi_q M^-1 Phi_q^T. The owner of an element owns its rows. The structure of the blocks must be
 * the same in all calls ---- */
class NearestSystem
{
public:
  explicit NearestSystem(Model &m) : M(m) {}
  ~NearestSystem();
  NearestSystem(const NearestSystem &) = delete;
  PetscErrorCode factor(const std::vector<RowBlock> &blocks);
  /* d: the change of poses or velocities, 6 numbers per body, that satisfies Phi_q d = rhs (rows in the order of the
     blocks) and is, in the metric of the masses, the smallest one or, unless `from` is null, the nearest one to `from` */
  PetscErrorCode             solve(const std::vector<RowBlock> &blocks, const std::vector<double> &rhs,
                                   const std::vector<double> *from, std::vector<double> &d);
  const std::vector<double> &weights() const { return weight_; } /* diagonal of Phi_q M^-1 Phi_q^T */

private:
  Model                &M;
  std::vector<PetscInt> row_; /* number of the first row of each block */
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
/* moves bodies rigidly to satisfy the constraints of all elements, or only of those marked in `elements`; ok: whether
   they are satisfied within the tolerance */
PetscErrorCode    ProjectPositions(Model &M, FixedBodies fixed_bodies, bool *ok, const std::vector<char> *elements = nullptr);
/* reports violations or projects the positions, as StartPolicy::assembly says */
PetscErrorCode    Assemble(Model &M);
std::vector<char> RigidElements(const SceneData &s, FixedBodies fixed_bodies); /* marks elements that only rigid motions can satisfy */
/* whether Assemble() has left violations that only deformations of flexible bodies can remove, so that the run's first
   state has to be projected */
bool              LeftToDeform(const SceneData &s);

/* ---- redundancy.cpp ---- */
PetscErrorCode DropRedundant(Model &M);

/* ---- inertia.cpp: bodies without mass or moments of inertia ---- */
void           FillLight(SceneData &s);          /* BodyData::light_mass, light_inertia */
PetscErrorCode CheckInertia(const SceneData &s); /* an error unless the constraints determine all movements without inertia */

/* ---- equilibrium.cpp: called after Number(); makes a Runtime of its own ---- */
PetscErrorCode FindEquilibrium(const std::shared_ptr<Model> &M);

/* ---- state.cpp: poses, velocities, deformations, variables and states of a run become the initial values of M; V null:
   all velocities are zero ---- */
PetscErrorCode WriteState(Model &M, Runtime &R, Vec U, Vec V);

} // namespace hhtdae

#endif
