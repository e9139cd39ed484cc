/* The surface of a reduced body: it is closed, oriented outwards, and has the modes of its nodes */
#include "fe_mesh.h"
#include "hhtdae/flexible.h"
#include "reduced_body.h"
#include <map>

using namespace hhtest;

namespace
{

constexpr int modes = 3;

/* A body with the model's mesh and with modes and stress modes that identify the node */
void Dress(const FeModel &model, ReducedBody *body)
{
  body->comm        = PETSC_COMM_SELF;
  body->own         = model.own;
  body->coordinates = model.coordinates;
  body->label       = model.label;
  body->elements    = model.elements;
  body->modal.omega = Eigen::VectorXd::LinSpaced(modes, 1, 2);
  body->modal.name  = "box";
  body->shape       = Numbers(3 * model.own, modes, 5);
  body->stress.values = Numbers(6 * model.own, modes, 6);
  for (PetscInt i = 0; i < model.own; i++) body->stress.node.push_back(i);
}

Vector3 PointOf(const Surface &s, int node) { return Eigen::Map<const Vector3>(&s.point[3 * (std::size_t)node]); }

} // namespace

TEST(Surface, IsClosedAndOfTheRightSize)
{
  for (ElementType type : {ElementType::Tetrahedron4, ElementType::Tetrahedron10, ElementType::Brick8, ElementType::Brick20}) {
    SCOPED_TRACE((int)type);
    MeshBox box;
    box.type = type;
    box.nx   = 4;
    box.ny   = 3;
    box.nz   = 2;
    box.lx   = 2;
    box.lz   = 0.5;
    FeModel     model(PETSC_COMM_SELF);
    ReducedBody body;
    Surface     s;
    must(readBox(model, box));
    Dress(model, &body);
    must(MakeSurface(body, &s));
    const std::size_t nodes = s.point.size() / 3;
    EXPECT_EQ(nodes, 5u * 4 * 3 - 3 * 2 * 1); /* corner nodes except inner ones */
    EXPECT_EQ(s.triangle.size(), 3u * 2 * 2 * (4 * 3 + 3 * 2 + 2 * 4));
    double                             volume = 0, area = 0;
    std::map<std::pair<int, int>, int> edge;
    for (std::size_t k = 0; k < s.triangle.size(); k += 3) {
      const Vector3 a = PointOf(s, s.triangle[k]), b = PointOf(s, s.triangle[k + 1]), c = PointOf(s, s.triangle[k + 2]);
      volume += a.dot(b.cross(c)) / 6;
      area += (b - a).cross(c - a).norm() / 2;
      for (int e = 0; e < 3; e++) edge[{s.triangle[k + e], s.triangle[k + (e + 1) % 3]}]++;
    }
    EXPECT_NEAR(volume, 2 * 1 * 0.5, 1e-12);
    EXPECT_NEAR(area, 2 * (2 * 1 + 1 * 0.5 + 2 * 0.5), 1e-12);
    for (const auto &[ends, times] : edge) {
      EXPECT_EQ(times, 1);
      EXPECT_TRUE(edge.count({ends.second, ends.first}));
    }
    ASSERT_EQ(s.shape.rows(), (Eigen::Index)(3 * nodes));
    ASSERT_EQ(s.stress.rows(), (Eigen::Index)(6 * nodes));
    for (std::size_t i = 0; i < nodes; i++) {
      PetscInt node = -1;
      for (PetscInt k = 0; k < model.own; k++)
        if ((Eigen::Map<const Vector3>(&model.coordinates[3 * (std::size_t)k]) - PointOf(s, (int)i)).norm() < 1e-12) node = k;
      ASSERT_GE(node, 0);
      EXPECT_EQ(s.shape.middleRows<3>(3 * (Eigen::Index)i), (body.shape.middleRows<3>(3 * node).cast<float>()));
      EXPECT_EQ(s.stress.middleRows<6>(6 * (Eigen::Index)i), (body.stress.values.middleRows<6>(6 * node).cast<float>()));
    }
  }
}

/* A cavity has a surface as well; if one surface node has no stress modes, the whole surface has none */
TEST(Surface, Cavities)
{
  MeshBox box;
  box.nx = box.ny = box.nz = 3;
  FeModel     model(PETSC_COMM_SELF);
  ReducedBody body;
  Surface     s;
  must(readBox(model, box));
  Dress(model, &body);
  const auto inner = std::find_if(body.elements.begin(), body.elements.end(), [&](const FeElement &e) {
    Vector3 middle = Vector3::Zero();
    for (int k = 0; k < 8; k++) middle += 0.125 * Eigen::Map<const Vector3>(&model.coordinates[3 * (std::size_t)e.node[k]]);
    return (middle - Vector3::Constant(0.5)).norm() < 1e-9;
  });
  ASSERT_NE(inner, body.elements.end());
  body.elements.erase(inner);
  body.stress.node.pop_back();
  body.stress.values.conservativeResize(body.stress.values.rows() - 6, modes);
  must(MakeSurface(body, &s));
  EXPECT_EQ(s.triangle.size(), 3u * 2 * 6 * (9 + 1));
  EXPECT_EQ(s.stress.size(), 0);
  double volume = 0;
  for (std::size_t k = 0; k < s.triangle.size(); k += 3) volume += PointOf(s, s.triangle[k]).dot(PointOf(s, s.triangle[k + 1]).cross(PointOf(s, s.triangle[k + 2]))) / 6;
  EXPECT_NEAR(volume, 26. / 27, 1e-12);
}

TEST(Surface, BodiesThatHaveNone)
{
  const HandMade made(PETSC_COMM_SELF);
  ReducedBody    body = made.body;
  Surface        s;
  ErrorTrap      trap;
  body.elements.clear();
  EXPECT_NE(MakeSurface(body, &s), 0);
  EXPECT_NE(trap.message.find("has no elements"), std::string::npos);
  body = made.body;
  body.shape.resize(0, 0);
  EXPECT_NE(MakeSurface(body, &s), 0);
  EXPECT_NE(trap.message.find("reduced with all nodes"), std::string::npos);
}
