/*
  Checkpoints. A damaged file is to be refused by its checksum, before anything of it is taken.
*/
#include "fuzz.h"
#include "support.h"
#include <fstream>
#include <sstream>

namespace hhtfuzz
{

namespace
{

using namespace hhtest;

const char *const settings = " -ts_rtol 1e-5 -ts_atol 1e-5 -ts_max_steps 60 ";

bool Finite(const Simulation &run)
{
  for (const Array &x : {run.u(), run.v(), run.a()})
    for (double v : x)
      if (!std::isfinite(v)) return false;
  return std::isfinite(run.t());
}

/* A grid of point masses on springs, solved by conjugate gradients with a coarse level: -pc_type hhtconstraint */
struct Net : Problem {
  static constexpr PetscInt nx = 4, ny = 3, nz = 2;
  struct Spring {
    PetscInt i, j;
  };
  std::vector<Spring> spring;

  Net()
  {
    n = 3 * nx * ny * nz;
    role.assign((size_t)n, TSHHT3_COORDINATE);
    for (PetscInt i = 0; i < n / 3; i++)
      for (PetscInt j = 0; j < i; j++)
        if (std::abs(place(i, 0) - place(j, 0)) <= 1 && std::abs(place(i, 1) - place(j, 1)) <= 1) spring.push_back({i, j});
  }
  static double place(PetscInt node, int k) { return (double)(k == 0 ? node % nx : k == 1 ? node / nx % ny : node / nx / ny); }
  void          initial(double *u, double *v) const override
  {
    for (PetscInt i = 0; i < n; i++) u[i] = 0.1 * std::sin((double)i), v[i] = 0;
  }
  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    for (PetscInt i = 0; i < n; i++) f[i] = a[i] + u[i];
    for (const Spring &s : spring)
      for (PetscInt k = 0; k < 3; k++) {
        const double force = (double)(k + 1) * (u[3 * s.i + k] - u[3 * s.j + k]);
        f[3 * s.i + k] += force;
        f[3 * s.j + k] -= force;
      }
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    for (PetscInt i = 0; i < n; i++) J.add(i, i, 1 + sa);
    for (const Spring &s : spring)
      for (PetscInt k = 0; k < 3; k++)
        for (PetscInt of : {s.i, s.j})
          for (PetscInt by : {s.i, s.j}) J.add(3 * of + k, 3 * by + k, of == by ? (double)(k + 1) : -(double)(k + 1));
  }
};

void Prepare(const Problem &, TS) {}

void Prepare(const Net &net, TS ts)
{
  IS  nodes;
  Vec reference;
  must(ISCreateStride(PETSC_COMM_SELF, net.n, 0, 1, &nodes));
  must(ISSetBlockSize(nodes, 3));
  must(VecCreateSeq(PETSC_COMM_SELF, net.n, &reference));
  for (PetscInt i = 0; i < net.n; i++) must(VecSetValue(reference, i, Net::place(i / 3, (int)(i % 3)), INSERT_VALUES));
  must(VecAssemblyBegin(reference));
  must(VecAssemblyEnd(reference));
  must(TSHHT3SetNodes(ts, nodes, reference));
  must(ISDestroy(&nodes));
  must(VecDestroy(&reference));
}

template <class P> std::string Settings() { return settings; }
template <> std::string        Settings<Net>() { return std::string(settings) + "-ksp_type cg -pc_type hhtconstraint -pc_hhtconstraint_aggregate 8 "; }

/* A refusal must name the file. An accepted file must have a finite state, which is still finite some steps later,
   unless the run ends with an error */
template <class P> void Resume(const std::string &folder, Answer *a)
{
  const P    problem;
  Simulation run(problem, Settings<P>());
  Prepare(problem, run.ts);
  a->code = TSHHT3CheckpointLoad(run.ts, (folder + "/checkpoint").c_str());
  if (!a->code) a->code = TSSetUp(run.ts);
  if (a->code) return;
  if (!Finite(run)) {
    a->nonsense = "a state that is not finite";
    return;
  }
  a->named = false;
  a->code  = run.solve();
  if (!a->code && !Finite(run)) a->nonsense = "a state that is not finite after some steps";
}

std::string Text(const std::string &file)
{
  std::ifstream     in(file, std::ios::binary);
  std::stringstream all;
  all << in.rdbuf();
  return all.str();
}

template <class P> std::vector<Input> Good()
{
  const P            problem;
  Simulation         run(problem, Settings<P>());
  Prepare(problem, run.ts);
  char               folder[PETSC_MAX_PATH_LEN];
  std::vector<Input> good;
  must(PetscGetTmp(PETSC_COMM_SELF, folder, sizeof folder));
  const std::string file = std::string(folder) + "/hhtfuzz" + std::to_string(getpid()) + ".checkpoint";
  for (int k = 1; k <= 30; k++) {
    must(run.step());
    if (k != 1 && k != 30) continue;
    must(TSHHT3CheckpointSave(run.ts, file.c_str()));
    good.push_back({{{"checkpoint", Text(file), true}}});
  }
  std::remove(file.c_str());
  return good;
}

Input Damage(const std::vector<Input> &good, Random &r)
{
  const Input &whole = r.of(good);
  Input        input = whole;
  DamageBytes(&input.files[0].text, r);
  input.refuse = input.files[0].text != whole.files[0].text;
  return input;
}

struct Swinging : Pendulum {
  Swinging() : Pendulum(-90., 0., 2.) {}
};

const Register pendulum({"checkpoint", Good<Swinging>, Damage, Resume<Swinging>}),
    variables({"checkpointvar", Good<UserVars>, Damage, Resume<UserVars>}), net({"checkpointnet", Good<Net>, Damage, Resume<Net>});

} // namespace

} // namespace hhtfuzz
