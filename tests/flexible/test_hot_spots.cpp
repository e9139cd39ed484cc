/* Stress from modal coordinates: von Mises stress, highest values of a run, fields for ParaView's library */
#include "flexible/node_order.h"
#include "hhtdae/flexible.h"
#include "reduced_body.h"
#include <limits>

using namespace hhtest;

namespace
{

/* One node with a stress mode for each component of stress */
ReducedBody SixModes()
{
  HandMade    made(PETSC_COMM_SELF, 1, 6);
  ReducedBody body   = made.body;
  body.stress.node   = {2};
  body.stress.values = Eigen::MatrixXd::Identity(6, 6);
  return body;
}

double OfOne(const ReducedBody &body, std::vector<double> s)
{
  std::vector<double> stress;
  must(VonMises(body, Eigen::Map<Eigen::VectorXd>(s.data(), 6), &stress));
  return stress.at(0);
}

bool HaveVtk() { return std::system("/usr/bin/python3 -c 'import vtk' > /dev/null 2>&1") == 0; }

std::string Output(const std::string &command)
{
  std::string text;
  char        buffer[256];
  FILE       *pipe = popen(command.c_str(), "r");
  while (pipe && std::fgets(buffer, sizeof buffer, pipe)) text += buffer;
  if (pipe) pclose(pipe);
  return text;
}

} // namespace

TEST(VonMises, KnownStates)
{
  const ReducedBody body = SixModes();
  EXPECT_DOUBLE_EQ(OfOne(body, {5, 0, 0, 0, 0, 0}), 5);
  EXPECT_DOUBLE_EQ(OfOne(body, {0, -3, 0, 0, 0, 0}), 3);
  EXPECT_NEAR(OfOne(body, {7, 7, 7, 0, 0, 0}), 0, 1e-14);
  for (int shear = 3; shear < 6; shear++) {
    std::vector<double> s(6, 0.0);
    s[(std::size_t)shear] = 2;
    EXPECT_DOUBLE_EQ(OfOne(body, s), 2 * std::sqrt(3.));
  }
  /* invariant under a rotation of the axes */
  const Matrix3 q = Eigen::AngleAxisd(0.9, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  Matrix3       t;
  t << 4, 1, -2, 1, -3, 0.5, -2, 0.5, 6;
  const Matrix3 r    = q * t * q.transpose();
  const auto    flat = [](const Matrix3 &m) {
    return std::vector<double>{m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(1, 2), m(2, 0)};
  };
  EXPECT_NEAR(OfOne(body, flat(t)), OfOne(body, flat(r)), 1e-13);
  EXPECT_GT(OfOne(body, flat(t)), 8);
}

TEST(VonMises, Refuses)
{
  const ReducedBody   body = SixModes();
  std::vector<double> stress;
  Eigen::VectorXd     eta = Eigen::VectorXd::Zero(6);
  ErrorTrap           trap;
  EXPECT_NE(VonMises(body, eta.head(5), &stress), 0);
  EXPECT_TRUE(trap.says("5 modal coordinates")) << trap.message;
  eta[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(VonMises(body, eta, &stress), 0);
  EXPECT_TRUE(trap.says("not finite")) << trap.message;
  HotSpots hot(body);
  EXPECT_NE(hot.add(0, eta), 0);
}

/* The result equals that of storing and sorting the whole history */
TEST(HotSpots, AgainstTheHistory)
{
  HandMade             made(PETSC_COMM_SELF, 40, 5);
  const ReducedBody   &body = made.body;
  HotSpots             hot(body);
  std::vector<double>  largest(body.stress.node.size(), -1), when(largest), stress;
  std::vector<HotSpot> spots;
  const double         distance = 2.2;
  for (int step = 0; step < 50; step++) {
    const Eigen::VectorXd eta = Numbers(5, 1, 100 + step);
    must(hot.add(0.01 * step, eta));
    must(VonMises(body, eta, &stress));
    for (std::size_t i = 0; i < stress.size(); i++)
      if (stress[i] > largest[i]) {
        largest[i] = stress[i];
        when[i]    = 0.01 * step;
      }
  }
  must(hot.highest(1000, distance, &spots));
  ASSERT_GT(spots.size(), 8u);
  std::vector<char> taken(largest.size(), 0);
  for (const HotSpot &spot : spots) {
    std::size_t best = largest.size();
    for (std::size_t i = 0; i < largest.size(); i++)
      if (!taken[i] && (best == largest.size() || largest[i] > largest[best])) best = i;
    ASSERT_LT(best, largest.size());
    const Eigen::Map<const Vector3> x(&body.coordinates[3 * (std::size_t)body.stress.node[best]]);
    EXPECT_EQ(spot.label, body.label[(std::size_t)body.stress.node[best]]);
    EXPECT_EQ(spot.stress, largest[best]);
    EXPECT_EQ(spot.time, when[best]);
    EXPECT_EQ(spot.position, x);
    for (std::size_t i = 0; i < largest.size(); i++) {
      const Eigen::Map<const Vector3> y(&body.coordinates[3 * (std::size_t)body.stress.node[i]]);
      if (i == best || (x - y).norm() < distance) taken[i] = 1;
    }
  }
  for (char t : taken) EXPECT_TRUE(t); /* all nodes were asked for */
}

/* More nodes and states than one block processes, against Eigen's product and the norm of the deviator */
TEST(HotSpots, AgainstEigensProduct)
{
  HandMade             made(PETSC_COMM_SELF, 150, 5);
  const ReducedBody   &body = made.body;
  HotSpots             hot(body);
  std::vector<HotSpot> spots;
  std::vector<double>  stress;
  const std::size_t    n = body.stress.node.size();
  ASSERT_GT(n, 130u);
  Eigen::VectorXd largest = Eigen::VectorXd::Zero((Eigen::Index)n);
  for (int step = 0; step < 21; step++) {
    const Eigen::VectorXd eta = Numbers(5, 1, 300 + step), s = body.stress.values * eta;
    must(hot.add(step, eta));
    must(VonMises(body, eta, &stress));
    for (Eigen::Index i = 0; i < (Eigen::Index)n; i++) {
      const Eigen::Array3d direct = s.segment<3>(6 * i).array() - s.segment<3>(6 * i).mean(), shear = s.segment<3>(6 * i + 3);
      const double         mises = std::sqrt(1.5 * (direct.square().sum() + 2 * shear.square().sum()));
      EXPECT_NEAR(stress[(std::size_t)i], mises, 1e-12 * (1 + mises));
      largest[i] = std::max(largest[i], mises);
    }
  }
  must(hot.highest((PetscInt)n, 0, &spots));
  ASSERT_EQ(spots.size(), n);
  std::sort(largest.data(), largest.data() + n, std::greater<double>());
  for (std::size_t k = 0; k < n; k++) EXPECT_NEAR(spots[k].stress, largest[(Eigen::Index)k], 1e-12 * (1 + largest[0])) << k;
}

TEST(HotSpots, TiesByLabelFirstTimeAndNothingYet)
{
  HandMade             made(PETSC_COMM_SELF, 6, 1);
  std::vector<HotSpot> spots;
  for (std::size_t s = 0; s < made.body.stress.node.size(); s++)
    made.body.stress.values.block<6, 1>(6 * (Eigen::Index)s, 0) << 1, 0, 0, 0, 0, 0;
  std::reverse(made.body.label.begin(), made.body.label.end());
  HotSpots hot(made.body);
  must(hot.highest(3, 0, &spots));
  EXPECT_TRUE(spots.empty());
  for (double time : {1., 2., 3.}) must(hot.add(time, Eigen::VectorXd::Constant(1, time == 2 || time == 3 ? -4. : 1.)));
  must(hot.highest(3, 0, &spots));
  ASSERT_EQ(spots.size(), 3u);
  std::vector<PetscInt> labels;
  for (PetscInt n : made.body.stress.node) labels.push_back(made.body.label[(std::size_t)n]);
  std::sort(labels.begin(), labels.end());
  for (std::size_t i = 0; i < 3; i++) {
    EXPECT_EQ(spots[i].label, labels[i]);
    EXPECT_EQ(spots[i].time, 2);
    EXPECT_EQ(spots[i].stress, 4);
  }
  ErrorTrap trap;
  EXPECT_NE(hot.highest(3, -1, &spots), 0);
  must(hot.add(4, Eigen::VectorXd::Constant(1, 5)));
  made.body.stress = StressModes();
  EXPECT_NE(hot.highest(3, 1, &spots), 0); /* the last state is still buffered, but the stress modes are gone */
  EXPECT_TRUE(trap.says("changed")) << trap.message;
  HotSpots none(made.body);
  EXPECT_NE(none.highest(3, 1, &spots), 0);
  EXPECT_TRUE(trap.says("AddStressModes")) << trap.message;
}

/* In VTK's order of nodes, each middle node of an edge, taken from Gmsh's order, lies in the middle of its edge */
TEST(Field, OrderOfNodes)
{
  const int gmsh10[][2]  = {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}},
            vtk10[][2]   = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
  const int  gmsh20[][2] = {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3},
                            {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};
  const int  vtk20[][2]  = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                            {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  const auto same        = [](const int *a, const int *b) {
    return (a[0] == b[0] && a[1] == b[1]) || (a[0] == b[1] && a[1] == b[0]);
  };
  for (int k = 0; k < 6; k++)
    EXPECT_TRUE(same(gmsh10[GmshPlace(ElementType::Tetrahedron10, 4 + k) - 4], vtk10[k])) << k;
  for (int k = 0; k < 12; k++) EXPECT_TRUE(same(gmsh20[GmshPlace(ElementType::Brick20, 8 + k) - 8], vtk20[k])) << k;
}

/* ParaView's library reads the file and finds our numbers */
TEST(Field, ReadByVtk)
{
  if (!HaveVtk()) GTEST_SKIP() << "python3-vtk9 is not installed";
  HandMade        made(PETSC_COMM_SELF);
  Scratch         file("field.vtu");
  Eigen::VectorXd eta  = Numbers(4, 1, 9);
  const Matrix3   axes = Eigen::AngleAxisd(1.1, Vector3(0, 1, 1).normalized()).toRotationMatrix();
  const Vector3   origin(1, 2, 3);
  must(WriteField(made.body, eta, file.name, origin, axes));
  const std::string script =
      "import vtk;r=vtk.vtkXMLUnstructuredGridReader();r.SetFileName(\"" + file.name +
      "\");r.Update();g=r.GetOutput();p=g.GetPointData();"
      "print(g.GetNumberOfPoints(),g.GetNumberOfCells(),g.GetCellType(0),g.GetCellType(4));"
      "print(*[p.GetArrayName(i) for i in range(p.GetNumberOfArrays())]);"
      "print(*[\"%.17g\"%v for v in "
      "g.GetPoint(5)+p.GetArray(\"displacement\").GetTuple(5)+p.GetArray(\"stress\").GetTuple(5)+"
      "p.GetArray(\"von_mises\").GetTuple(5)+p.GetArray(\"label\").GetTuple(5)+p.GetArray(\"von_mises\").GetTuple(0)]);"
      "c=g.GetCell(4);print(*[c.GetPointId(i) for i in range(c.GetNumberOfPoints())])";
  std::istringstream out(Output("/usr/bin/python3 -c '" + script + "' 2>&1"));
  int                points = 0, cells = 0, first = 0, last = 0;
  std::string        line, value;
  double             v[15];
  out >> points >> cells >> first >> last;
  EXPECT_EQ(points, 24);
  EXPECT_EQ(cells, 5);
  EXPECT_EQ(first, 12);
  EXPECT_EQ(last, 10);
  std::getline(out, line);
  std::getline(out, line);
  EXPECT_EQ(line, "displacement label von_mises stress");
  for (double &x : v) {
    out >> value;
    x = std::strtod(value.c_str(), nullptr);
  }
  const Vector3 X(&made.body.coordinates[15]), x = origin + axes * X,
                                               u = axes * (made.body.shape.middleRows<3>(15) * eta);
  const Eigen::Index s =
      std::find(made.body.stress.node.begin(), made.body.stress.node.end(), 5) - made.body.stress.node.begin();
  const Eigen::VectorXd six = made.body.stress.values.middleRows<6>(6 * s) * eta;
  Matrix3               t;
  t << six[0], six[3], six[5], six[3], six[1], six[4], six[5], six[4], six[2];
  t = (axes * t * axes.transpose()).eval();
  std::vector<double> stress;
  must(VonMises(made.body, eta, &stress));
  const double expected[] = {
      x[0], x[1], x[2], u[0], u[1], u[2], t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(1, 2), t(2, 0), stress[(std::size_t)s],
      1015};
  for (int i = 0; i < 14; i++)
    EXPECT_NEAR(v[i], expected[i], 1e-12 * (1 + std::abs(expected[i]) + (i > 5 ? 1e6 : 0))) << i;
  EXPECT_TRUE(std::isnan(v[14])); /* node 0 has no stress modes */
  for (int n : {16, 17, 18, 21}) {
    int id = -1;
    out >> id;
    EXPECT_EQ(id, n);
  }
}

TEST(Field, Refuses)
{
  HandMade  made(PETSC_COMM_SELF);
  Scratch   file("none.vtu");
  ErrorTrap trap;
  EXPECT_NE(WriteField(made.body, Eigen::VectorXd::Zero(3), file.name), 0);
  EXPECT_TRUE(trap.says("3 modal coordinates")) << trap.message;
  EXPECT_NE(WriteField(made.body, Eigen::VectorXd::Zero(4), "/nowhere/field.vtu"), 0);
  EXPECT_TRUE(trap.says("/nowhere/field.vtu")) << trap.message;
  made.body.shape.resize(0, 0);
  EXPECT_NE(WriteField(made.body, Eigen::VectorXd::Zero(4), file.name), 0);
  EXPECT_TRUE(trap.says("no modes at its nodes")) << trap.message;
  EXPECT_FALSE(file.exists());
}
