/* Options of this library that nothing reads are reported, together with the name that was probably meant */
#include "integrator/type/unused.h"
#include "support.h"

#include <hhtdae/scene.h>

using namespace hhtest;

namespace
{

/* The message at the end of a program with these options, in which `use` has been called */
std::string reportOf(const std::string &options, const std::function<void()> &use = [] {})
{
  Options in(options);
  Printed out;
  use();
  must(hht3::ReportUnusedOptions());
  return out.text();
}

void readOptions(const char *prefix = nullptr)
{
  TS ts;
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetOptionsPrefix(ts, prefix));
  must(TSSetType(ts, TSHHT3));
  must(TSSetFromOptions(ts));
  must(TSDestroy(&ts));
}

bool says(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

} // namespace

TEST(UnusedOptions, MisspeltWithTheNearest)
{
  const std::string r = reportOf("-ts_hhtdae_aplha -0.1 -ts_hhtdae_sumary -ts_hhtdae_checkpoint_evry 3", [] { readOptions(); });
  EXPECT_TRUE(says(r, "-ts_hhtdae_aplha was not used: there is no such option; the nearest is -ts_hhtdae_alpha\n")) << r;
  EXPECT_TRUE(says(r, "the nearest is -ts_hhtdae_summary\n")) << r;
  EXPECT_TRUE(says(r, "the nearest is -ts_hhtdae_checkpoint_every\n")) << r;
}

TEST(UnusedOptions, PrefixOfAnObject)
{
  const std::string r = reportOf("-left_ts_hhtdae_alpha -0.1 -left_ts_hhtdae_from paper -right_ts_hhtdae_alpha -0.2", [] { readOptions("left_"); });
  EXPECT_FALSE(says(r, "-left_ts_hhtdae_alpha was")) << r;
  EXPECT_TRUE(says(r, "-left_ts_hhtdae_from was not used: there is no such option; the nearest is -left_ts_hhtdae_form\n")) << r;
  EXPECT_TRUE(says(r, "-right_ts_hhtdae_alpha was not used: nobody has read it")) << r;
}

/* No report if one of several TS has used the option; PETSc's own options are left to PETSc */
TEST(UnusedOptions, NoFalseAlarms)
{
  const std::string own = "-ts_hhtdae_alpha -0.1 -ts_hhtdae_reuse 1.4,0.25,1.2 ";
  EXPECT_EQ(reportOf(own, [] {
              TS other;
              must(TSCreate(PETSC_COMM_SELF, &other));
              must(TSSetType(other, TSHHT3));
              readOptions();
              must(TSDestroy(&other));
            }),
            "");
  EXPECT_EQ(reportOf("-nobodys 3 -obscene_dt 1 -my_ts_dt 1 -ts_adapt_tpye none"), "");
  EXPECT_EQ(reportOf(""), "");
}

TEST(UnusedOptions, SetButNeverRead) { EXPECT_TRUE(says(reportOf("-ts_hhtdae_alpha -0.1"), "-ts_hhtdae_alpha was not used: nobody has read it")); }

namespace
{

void makeScene()
{
  using namespace hhtdae;
  Scene     scene(PETSC_COMM_SELF);
  RigidBody rod;
  rod.position = {.5, 0, 0};
  Body arm     = scene.add("arm", rod);
  scene.add("pin", Revolute{scene.marker(arm, {-.5, 0, 0}), scene.marker(scene.ground())});
  TS ts;
  must(scene.createTS(&ts));
  must(TSSetMaxTime(ts, 1e-3));
  must(TSSetFromOptions(ts));
  must(scene.solve(ts));
  must(TSDestroy(&ts));
}

} // namespace

TEST(UnusedOptions, OfScenes)
{
  const std::string r = reportOf("-scene_asemble project -scene_redundant keep -scene_rate 100", makeScene);
  EXPECT_TRUE(says(r, "-scene_asemble was not used: there is no such option; the nearest is -scene_assemble\n")) << r;
  EXPECT_FALSE(says(r, "-scene_redundant")) << r;
  EXPECT_FALSE(says(r, "-scene_rate")) << r;
}
