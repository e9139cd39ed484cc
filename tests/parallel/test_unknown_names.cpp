/* Names of unknowns in messages are the same on any number of ranks, wherever their rows are */
#include "box_model.h"
#include "scene/model.h"
#include "scene_start.h"
#include <algorithm>
#include <set>

using namespace hhtdae;
using namespace hhtest;

namespace
{

/* Rods that hang from one another, with a variable and a state, on a pin that is described twice */
void hang(Scene &scene)
{
  Body before = scene.ground();
  for (int k = 0; k < 9; k++) {
    const Vector3 from(k, 0, 0), to(k + 1, 0, 0);
    const Body    b    = scene.add("rod " + std::to_string(k), rod(from, to));
    const Matrix3 turn = axesAlong({0, 0, 1});
    scene.add("pin " + std::to_string(k), Revolute{scene.markerAt(b, from, turn), scene.markerAt(before, from, turn)});
    if (k == 4) scene.add("again", Revolute{scene.markerAt(b, from, turn), scene.markerAt(before, from, turn)});
    before = b;
  }
  const State s = scene.state("valve", Expression{{}, [](const Real *) -> Real { return 0; }}, 0);
  scene.variable("pressure", Expression{{Measure::value(s)}, [](const Real *k) -> Real { return k[0]; }});
  scene.start().redundant = Redundant::Drop;
}

std::vector<std::string> sorted(Scene &scene)
{
  std::vector<std::string> all;
  must(scene.setUp());
  for (PetscInt i = 0; i < ModelOf(scene).number.first.back(); i++) all.push_back(UnknownName(ModelOf(scene), i));
  std::sort(all.begin(), all.end());
  return all;
}

} // namespace

TEST(UnknownNamesOnRanks, OfAMechanism)
{
  Scene   all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  Printed quiet;
  hang(all);
  hang(alone);
  const std::vector<std::string> names = sorted(all);
  EXPECT_EQ(names, sorted(alone));
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
}

/* Nodes of a whole body, a part of which each rank numbers */
TEST(UnknownNamesOnRanks, OfNodes)
{
  std::vector<std::string> names[2];
  for (MPI_Comm comm : {PETSC_COMM_WORLD, PETSC_COMM_SELF}) {
    FeModel    model(comm);
    BoxBuilder nodes(Box{{4, 1, 1}, {.4, .1, .1}}, &model);
    Scene      scene(comm);
    FullFeBody fe;
    FullBody   b;
    b.attachments = {{"left"}};
    must(fe.add(scene, "beam", model, b));
    scene.add("clamp", Fixed{scene.marker(fe.attachment("left")), scene.marker(scene.ground(), {0, .05, .05})});
    std::vector<std::string> &n = names[comm == PETSC_COMM_SELF];
    n = sorted(scene);
    ASSERT_EQ(std::count_if(n.begin(), n.end(), [](const std::string &s) { return s.find(" of node ") != std::string::npos; }), 3 * 20) << n[0];
    EXPECT_TRUE(std::binary_search(n.begin(), n.end(), std::string("z of node 19 (from 0) of body beam")));
  }
  EXPECT_EQ(names[0], names[1]);
}
