/* Reduction of small models, including special cases; on one rank */
#include "box_model.h"
#include "flexible/diagnose.h"
#include "reduction_cases.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

int stages()
{
#if PETSC_VERSION_LT(3, 20, 0)
  PetscStageLog log;
  must(PetscLogGetStageLog(&log));
  return log->numStages;
#else
  PetscLogState state;
  PetscInt      count;
  must(PetscLogGetState(&state));
  must(PetscLogStateGetNumStages(state, &count));
  return (int)count;
#endif
}

int factorizations()
{
  PetscLogEvent      event;
  PetscEventPerfInfo info;
  int                count = 0;
  must(PetscLogEventGetId("MatCholFctrNum", &event));
  for (int s = 0; s < stages(); s++) {
    must(PetscLogEventGetPerfInfo(s, event, &info));
    count += info.count;
  }
  return count;
}

} // namespace

TEST(Reduction, RigidBodyHasNoModes)
{
  Made        m(bar());
  Reduction   r;
  ReducedBody body;
  r.modes = 0;
  must(Reduce(m.model, r, &body));
  const double mass = 7850 * 0.5 * 0.06 * 0.08;
  EXPECT_EQ(body.modal.modes(), 0);
  EXPECT_EQ(body.modal.first.cols(), 0);
  EXPECT_EQ(body.modal.quadratic[0].size(), 0);
  EXPECT_NEAR(body.modal.mass, mass, 1e-12 * mass);
  EXPECT_LT((body.modal.center - Vector3(0.25, 0.03, 0.04)).norm(), 1e-13);
  const Vector3 square(0.25, 0.0036, 0.0064); /* int X_c^2 dm = m a_c^2 / 12 */
  EXPECT_LT((body.modal.moments - Matrix3(square.asDiagonal()) * mass / 12).norm(), 1e-12 * mass);
  EXPECT_EQ(body.own, m.model.own);
  EXPECT_EQ(body.shape.cols(), 0);
}

TEST(Reduction, OneAttachmentWithoutModesIsRigid)
{
  for (Method method : {Method::CraigBampton, Method::Static, Method::FreeFree}) {
    Made        m(bar());
    Reduction   r;
    ReducedBody body;
    r.modes       = 0;
    r.method      = method;
    r.attachments = {attach("right")};
    must(Reduce(m.model, r, &body));
    EXPECT_EQ(body.modal.modes(), 0);
    ASSERT_EQ(body.modal.attachments.size(), 1u);
    EXPECT_LT((body.modal.attachments[0].position - Vector3(0.5, 0.03, 0.04)).norm(), 1e-13);
    EXPECT_EQ(body.modal.attachments[0].rotation.cols(), 0);
  }
}

TEST(Reduction, NumbersOfModes)
{
  Made        m(bar());
  ReducedBody body;
  must(Reduce(m.model, both(4), &body));
  EXPECT_EQ(body.modal.modes(), 2 * 6 + 4 - 6);
  EXPECT_EQ(body.method, "Craig-Bampton");
  Reduction guyan = both(4);
  guyan.method    = Method::Static;
  must(Reduce(m.model, guyan, &body));
  EXPECT_EQ(body.modal.modes(), 6);
  Reduction free = both(4, Tie::Average);
  free.method    = Method::FreeFree;
  must(Reduce(m.model, free, &body));
  EXPECT_EQ(body.modal.modes(), 4);
  Reduction none;
  none.modes = 5; /* without attachments: modes of the free body */
  must(Reduce(m.model, none, &body));
  EXPECT_EQ(body.modal.modes(), 5);
  EXPECT_EQ(body.method, "free-free");
}

/* If more modes are requested than exist, all are returned, with the frequencies of the full model */
TEST(Reduction, AllModesOfASmallModel)
{
  Made        m(bar(3, 1, 1));
  Reduction   r = both(1000);
  ReducedBody body;
  must(Reduce(m.model, r, &body));
  EXPECT_EQ(body.modal.modes(), 3 * 8 + 12 - 6); /* eight nodes are free */
  for (const ReducedMode &mode : body.mode) EXPECT_LT(mode.residual, 1e-6);
}

TEST(Reduction, Selection)
{
  Made        m(bar());
  ReducedBody all, some;
  Reduction   r = both(6);
  must(Reduce(m.model, r, &all));
  r.keep = {7, 0, 3};
  must(Reduce(m.model, r, &some));
  ASSERT_EQ(some.modal.modes(), 3);
  for (int k = 0; k < 3; k++)
    EXPECT_NEAR(some.modal.omega[k], all.modal.omega[k == 0 ? 0 : k == 1 ? 3 : 7], 1e-9 * all.modal.omega[7]);
  r.keep.clear();
  r.keep_below = 0.5 * (all.mode[4].frequency + all.mode[5].frequency);
  must(Reduce(m.model, r, &some));
  EXPECT_EQ(some.modal.modes(), 5);
  EXPECT_NEAR(some.elastic_scale, std::pow(some.modal.omega[4], 2), 1e-9 * some.elastic_scale);
}

/* A bound that leaves no modes gives a rigid body, or one of constraint modes, and a notice; to ask for none is none */
TEST(Reduction, NoticesOfMissingModes)
{
  Made        m(bar());
  ReducedBody body;
  const auto  notice = [&](const Reduction &r) {
    testing::internal::CaptureStdout();
    const PetscErrorCode failed = Reduce(m.model, r, &body);
    const std::string    text   = testing::internal::GetCapturedStdout();
    must(failed);
    return text;
  };
  Reduction r = both(6);
  EXPECT_EQ(notice(r), "");
  const double slowest = body.mode[0].frequency;
  r.keep_below         = 1e-3;
  const std::string none = notice(r);
  EXPECT_EQ(body.modal.modes(), 0);
  EXPECT_NE(none.find("keep_below = 0.001 leaves none of 12 modes"), std::string::npos) << none;
  char number[32];
  snprintf(number, sizeof number, "%g: the body is rigid", slowest);
  EXPECT_NE(none.find(number), std::string::npos) << none;
  r               = both(6);
  r.max_frequency = 1e-3;
  for (PetscInt modes : {(PetscInt)6, (PetscInt)PETSC_DEFAULT}) {
    r.modes = modes;
    EXPECT_EQ(notice(r), "reduce: no normal mode has a frequency below max_frequency = 0.001: the body has constraint modes alone\n");
    EXPECT_EQ(body.modal.modes(), 6);
  }
  r.attachments.pop_back();
  EXPECT_EQ(notice(r), "reduce: no normal mode has a frequency below max_frequency = 0.001: the body is rigid\n");
  r.method = Method::Static;
  EXPECT_EQ(notice(r), "reduce: constraint modes of fewer than two attachments are rigid motions: the body is rigid\n");
  r        = both(0);
  r.method = Method::CraigBampton;
  EXPECT_EQ(notice(r), "");
  r.attachments.pop_back();
  EXPECT_EQ(notice(r), "");
  EXPECT_EQ(body.modal.modes(), 0);
}

TEST(Reduction, NodesAreLeftOut)
{
  Made        m(bar());
  ReducedBody body;
  Reduction   r = both();
  r.all_nodes   = false;
  must(Reduce(m.model, r, &body));
  EXPECT_EQ(body.own, 0);
  EXPECT_EQ(body.shape.size(), 0);
  EXPECT_TRUE(body.coordinates.empty());
  EXPECT_EQ(body.fe_nodes, m.model.nodes);
}

/* All modes below a frequency, by an inertia count or by slices of the spectrum, equal those requested by number */
TEST(Reduction, AllBelowAFrequency)
{
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    Made        m(bar(10, 2, 2));
    ReducedBody number, counted, sliced;
    Reduction   r = both(14, tie);
    must(Reduce(m.model, r, &number));
    r.modes         = PETSC_DEFAULT;
    r.max_frequency = 40e3;
    must(Reduce(m.model, r, &counted));
    const PetscInt n = counted.modal.modes() - 6;
    ASSERT_GT(n, 8);
    r.modes         = n;
    r.max_frequency = 0;
    must(Reduce(m.model, r, &number));
    r.modes         = PETSC_DEFAULT;
    r.max_frequency = 40e3;
    {
      Options options("-reduce_slices_from 1");
      must(Reduce(m.model, r, &sliced));
    }
    ASSERT_EQ(sliced.modal.modes(), n + 6);
    EXPECT_LT((number.modal.omega - counted.modal.omega).cwiseQuotient(number.modal.omega).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((number.modal.omega - sliced.modal.omega).cwiseQuotient(number.modal.omega).cwiseAbs().maxCoeff(), 1e-9);
    /* one more mode lies above the bound */
    r.modes = n + 1;
    must(Reduce(m.model, r, &number));
    EXPECT_EQ(number.modal.modes(), n + 6);
  }
}

TEST(Reduction, FreeModesBelowAFrequency)
{
  Made        m(bar(10, 2, 2));
  ReducedBody body, sliced;
  Reduction   r;
  r.modes         = PETSC_DEFAULT;
  r.max_frequency = 20e3;
  must(Reduce(m.model, r, &body));
  ASSERT_GT(body.modal.modes(), 6);
  Options options("-reduce_slices_from 1");
  must(Reduce(m.model, r, &sliced));
  ASSERT_EQ(sliced.modal.modes(), body.modal.modes());
  EXPECT_LT((body.modal.omega - sliced.modal.omega).cwiseQuotient(body.modal.omega).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(body.mode.back().frequency, 20e3);
}

/* Multiple eigenvalues are found completely: eight identical pieces of bar between rigid attachments */
TEST(Reduction, CopiesOfEigenvaluesAreFound)
{
  Box       box = {{16, 1, 1}, {1.6, 0.1, 0.1}};
  Made      m(box);
  Reduction r;
  for (int a = 0; a <= 8; a++) {
    const std::string name = "section " + std::to_string(a);
    m.builder.addSet(name, [a](const Vector3 &x) { return std::abs(x[0] - 0.2 * a) < 0.01; });
    r.attachments.push_back(attach(name));
  }
  r.modes = 8 * 12; /* each piece has one section of four free nodes */
  ReducedBody body;
  must(Reduce(m.model, r, &body));
  EXPECT_EQ(body.modal.modes(), 9 * 6 + 96 - 6);
  r.modes = 8;
  must(Reduce(m.model, r, &body));
  EXPECT_EQ(body.modal.modes(), 9 * 6 + 8 - 6);
}

/* One factorization serves constraint modes and normal modes */
TEST(Reduction, FactorsOnce)
{
  must(PetscLogDefaultBegin());
  Made        m(bar());
  ReducedBody body;
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    const int before = factorizations();
    {
      Options options("-reduce_verify 0");
      must(Reduce(m.model, both(4, tie), &body));
    }
    EXPECT_EQ(factorizations() - before, 1);
    must(Reduce(m.model, both(4, tie), &body));
    EXPECT_EQ(factorizations() - before, 3); /* plus one for counting modes */
  }
}

TEST(Reduction, SolversByOptions)
{
  Made        m(bar());
  ReducedBody usual, other;
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    must(Reduce(m.model, both(6, tie), &usual));
    for (const char *text : {"-reduce_pc_factor_mat_solver_type mumps", "-reduce_eps_type krylovschur",
                             "-reduce_eps_krylov_block 1", "-reduce_eps_krylov_block 25 -reduce_eps_ncv 12",
                             "-reduce_ksp_type minres -reduce_pc_type none -reduce_ksp_max_it 20000"}) {
      Options options(text);
      must(Reduce(m.model, both(6, tie), &other));
      EXPECT_LT((usual.modal.omega - other.modal.omega).cwiseQuotient(usual.modal.omega).cwiseAbs().maxCoeff(), 1e-7)
          << text;
      if (tie == Tie::Average) break; /* minres without a preconditioner does not converge for a saddle point problem */
    }
  }
}

TEST(Reduction, ProgressOfThePhases)
{
  Made        m(bar());
  ReducedBody body;
  Reduction   r = both();
  Printed     printed;
  must(Reduce(m.model, r, &body));
  EXPECT_EQ(printed.text(), "");
  r.progress = true;
  must(Reduce(m.model, r, &body));
  for (const char *phase :
       {"checks", "factorization", "constraint modes", "normal modes", "reduced pair", "invariants", " MB"})
    EXPECT_TRUE(printed.says(phase));
  EXPECT_FALSE(printed.says("units"));
}

/* If an attachment point is away from its nodes, its motion is that of the nearest rigid motion of the nodes, for both ties */
TEST(Reduction, AttachmentAwayFromItsNodes)
{
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    Made        m(bar());
    ReducedBody at, away;
    Reduction   r = both(4, tie);
    must(Reduce(m.model, r, &at));
    r.attachments[1].at_given = true;
    r.attachments[1].position = Vector3(0.7, 0.1, -0.2);
    must(Reduce(m.model, r, &away));
    const ModalAttachment &p = at.modal.attachments[1], &q = away.modal.attachments[1];
    EXPECT_LT((at.modal.omega - away.modal.omega).cwiseQuotient(at.modal.omega).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT((q.rotation - p.rotation).cwiseAbs().maxCoeff(), 1e-5 * p.rotation.cwiseAbs().maxCoeff());
    EXPECT_LT((q.translation - p.translation + Cross(q.position - p.position) * p.rotation).cwiseAbs().maxCoeff(),
              1e-5 * p.rotation.cwiseAbs().maxCoeff());
  }
}

/* An averaging attachment adds no stiffness: the geometric stiffening by loads on one attachment of a free body does
   not change if a second averaging attachment shares its nodes */
TEST(Reduction, StiffeningOfAveragesThatShareNodes)
{
  Made        m(bar());
  ReducedBody alone, beside;
  Reduction   r;
  m.builder.addSet("half", [](const Vector3 &x) { return x[0] < 0.25; });
  r.method      = Method::FreeFree;
  r.modes       = 6;
  r.stiffening  = true;
  r.attachments = {attach("left", Tie::Average)};
  must(Reduce(m.model, r, &alone));
  r.attachments.push_back(attach("half", Tie::Average));
  must(Reduce(m.model, r, &beside));
  ASSERT_EQ(alone.modal.modes(), beside.modal.modes());
  for (int c = 0; c < 6; c++) {
    const Eigen::MatrixXd &x = alone.modal.attachments[0].stiffening[c], &p = alone.modal.stiffening[c];
    EXPECT_LT((beside.modal.attachments[0].stiffening[c] - x).cwiseAbs().maxCoeff(), 1e-6 * x.cwiseAbs().maxCoeff()) << c;
    EXPECT_LT((beside.modal.stiffening[c] - p).cwiseAbs().maxCoeff(), 1e-6 * p.cwiseAbs().maxCoeff()) << c;
  }
}

TEST(Reduction, SuspectUnits)
{
  Box box            = bar();
  box.material.young = 2.1e5; /* Young's modulus in N/mm^2, lengths in m, mass in kg */
  Made        m(box);
  ReducedBody body;
  Reduction   r = both();
  r.progress    = true;
  Printed printed;
  must(Reduce(m.model, r, &body));
  EXPECT_TRUE(printed.says("units suspect"));
  /* The systems N, mm, tonne, s and mm, kg, ms are consistent */
  for (double mass : {7.85e-9, 7.85e-6}) {
    Box        mm = {{6, 2, 2}, {500, 60, 80}, {mass < 1e-8 ? 2.1e5 : 210., 0.3, mass}};
    Made       n(mm);
    BodyScales scales;
    must(ComputeScales(n.model, &scales));
    EXPECT_EQ(SuspectUnits(n.model, scales), "");
  }
}
