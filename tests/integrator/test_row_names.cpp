/* The application's names of rows appear in messages about these rows */
#include "support.h"

using namespace hhtest;

namespace
{

PetscErrorCode nameOf(TS, PetscInt row, char name[], size_t len, void *)
{
  static const char *const names[] = {"x of the bob", "y of the bob"};
  return row < 2 ? PetscStrncpy(name, names[row], len) : (PetscErrorCode)0;
}

/* A pendulum with rows that are NaN from some time on */
struct Torn : Pendulum {
  double from;
  bool   matrix;
  Torn(double t, bool m) : Pendulum(-60., 1., 1.), from(t), matrix(m) {}
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    if (t >= from && !matrix) f[1] = NAN;
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa, hhtex::Entries &e) const override
  {
    Pendulum::jacobian(t, u, v, a, sv, sa, e);
    e.add(1, 1, t >= from && matrix ? NAN : 0);
  }
};

std::string messageOf(const Torn &p, bool named)
{
  Simulation run(p, tolerance(1e-4));
  ErrorTrap  trap;
  EXPECT_EQ(TSHHT3SetRowName(run.ts, named ? nameOf : nullptr, nullptr), 0);
  EXPECT_NE(run.solve(), 0);
  return trap.message;
}

void expectSays(const std::string &message, const std::string &part) { EXPECT_NE(message.find(part), std::string::npos) << message; }

} // namespace

TEST(RowNames, OfWhatIsNoNumberAtTheStart)
{
  expectSays(messageOf(Torn(0, false), true), "the application's residual is not a number at t = 0., first in row 1 (y of the bob), the equation of motion");
  expectSays(messageOf(Torn(0, false), false), "first in row 1, the equation of motion");
  expectSays(messageOf(Torn(0, true), true), "Jacobian (TSSetI2Jacobian()) is not a number at t = 0., first in row 1 (y of the bob)");
}

TEST(RowNames, OfWhatIsNoNumberLater)
{
  expectSays(messageOf(Torn(.2, false), true), "residual is not a number at t = 0.2, first in row 1 (y of the bob), the equation of motion");
  expectSays(messageOf(Torn(.2, true), true), "Jacobian (TSSetI2Jacobian()) is not a number at t = 0.2, first in row 1 (y of the bob)");
}

TEST(RowNames, OfInitialValues)
{
  const Pendulum p(-60., 1., 1.);
  Simulation     run(p, tolerance(1e-4));
  ErrorTrap      trap;
  Vec            u, v;
  ASSERT_EQ(TSHHT3SetRowName(run.ts, nameOf, nullptr), 0);
  ASSERT_EQ(TS2GetSolution(run.ts, &u, &v), 0);
  ASSERT_EQ(VecSetValue(v, 0, NAN, INSERT_VALUES), 0);
  ASSERT_EQ(VecAssemblyBegin(v), 0);
  ASSERT_EQ(VecAssemblyEnd(v), 0);
  EXPECT_NE(TSSolve(run.ts, u), 0);
  EXPECT_TRUE(trap.says("of unknown 0 (x of the bob) is not a number")) << trap.message;
}

/* The constraint's row has no name here, and the message gives its number */
TEST(RowNames, OfViolatedConstraints)
{
  const Pendulum p(-60., 1., 1.);
  Simulation     run(p, tolerance(1e-6));
  Printed        out;
  ASSERT_EQ(TSHHT3SetRowName(run.ts, nameOf, nullptr), 0);
  ASSERT_EQ(VecScale(run.U, 1 + 1e-4), 0);
  must(run.step());
  EXPECT_TRUE(out.says("in row 2. Give")) << out.text();
}
