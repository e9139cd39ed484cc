/* Surfaces of whole finite-element bodies: coarsened surfaces keep their shape; the stress in a page is that of the load */
#include "fe_mesh.h"
#include "flexible/surface.h"
#include "scene_output.h"

#if defined(HHTDAE_PAGE)
  #include "page_reader.h"
#endif

using namespace hhtest;

namespace
{

/* Volume enclosed by the triangles */
double volume(const std::vector<double> &point, const std::vector<int> &triangle)
{
  double     sum = 0;
  const auto at  = [&](int n) { return Eigen::Map<const Vector3>(&point[3 * (std::size_t)n]); };
  for (std::size_t k = 0; k < triangle.size(); k += 3) sum += Vector3(at(triangle[k])).dot(Vector3(at(triangle[k + 1])).cross(Vector3(at(triangle[k + 2])))) / 6;
  return sum;
}

} // namespace

TEST(ThinSurface, KeepsTheShape)
{
  for (const auto &[most, allowed] : {std::make_pair(2000, 1e-12), std::make_pair(600, 0.1), std::make_pair(150, 0.2)}) {
    SCOPED_TRACE(most);
    MeshBox box;
    box.type = ElementType::Brick8;
    box.nx   = 40;
    box.ny   = 8;
    box.nz   = 4;
    box.lx   = 5;
    box.lz   = 0.2; /* thin: its two sides must not be merged */
    FeModel                  model(PETSC_COMM_SELF);
    std::vector<PetscInt>    node;
    std::vector<int>         triangle;
    std::vector<double>      point, thin;
    std::vector<std::size_t> kept;
    must(readBox(model, box));
    OuterTriangles(model.elements, &node, &triangle);
    for (PetscInt n : node) point.insert(point.end(), &model.coordinates[3 * (std::size_t)n], &model.coordinates[3 * (std::size_t)n] + 3);
    ASSERT_EQ(point.size() / 3, 41u * 9 * 5 - 39u * 7 * 3);
    ThinSurface(point, (std::size_t)most, &kept, &triangle);
    EXPECT_LE(kept.size(), (std::size_t)most);
    EXPECT_GE(kept.size(), std::min(point.size() / 3, (std::size_t)most / 2));
    EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
    for (std::size_t k : kept) thin.insert(thin.end(), &point[3 * k], &point[3 * k] + 3);
    for (int n : triangle) ASSERT_LT((std::size_t)n, kept.size());
    EXPECT_NEAR(volume(thin, triangle), 1, allowed);
  }
}

/* However large the cells of the coarsening are, each side of the body keeps at least one cluster; the search for
   fewer clusters had not ended */
TEST(ThinSurface, OfFewNodes)
{
  for (const std::size_t most : {1, 3, 6, 20}) {
    MeshBox                  box;
    FeModel                  model(PETSC_COMM_SELF);
    std::vector<PetscInt>    node;
    std::vector<int>         triangle;
    std::vector<double>      point;
    std::vector<std::size_t> kept;
    box.type = ElementType::Brick8;
    must(readBox(model, box));
    OuterTriangles(model.elements, &node, &triangle);
    for (PetscInt n : node)
      for (std::size_t k = 0; k < 3; k++) point.push_back(model.coordinates[3 * (std::size_t)n + k] - 0.5); /* on both sides of the origin */
    ThinSurface(point, most, &kept, &triangle);
    EXPECT_GE(kept.size(), 1u);
    EXPECT_LE(kept.size(), std::max(most, (std::size_t)6));
  }
}

#if defined(HHTDAE_PAGE)

/* A bar without lateral contraction under tension: the stress is force over area everywhere, and at large strains the
   Cauchy stress */
TEST(FullPage, StressOfABarUnderTension)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large})
    for (ElementType type : {ElementType::Tetrahedron10, ElementType::Brick8, ElementType::Brick20}) {
      SCOPED_TRACE(std::to_string((int)type) + (law == FeLaw::Small ? ", small" : ", large"));
      TemporaryFile file("tension.html");
      MeshBox       box;
      box.type = type;
      box.nx   = 4;
      box.lx   = 2;
      box.ly   = 0.3;
      box.lz   = 0.2;
      FeModel model(PETSC_COMM_SELF);
      must(readBox(model, box, {{"", {2e6, 0, 1000}}}));
      Scene      scene(PETSC_COMM_SELF);
      FullFeBody fe;
      FullBody   b;
      b.law         = law;
      b.attachments = {{"left"}, {"right"}};
      must(fe.add(scene, "bar", model, b));
      const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
      scene.add("clamp", Fixed{left, scene.marker(scene.ground(), {0, 0.15, 0.1})});
      scene.add("pull", UserForce{right, {}, {}, {Expression{{}, [](const Real *) { return Real(2400.); }}, Expression{{}, [](const Real *) { return Real(0.); }}, Expression{{}, [](const Real *) { return Real(0.); }}}, {}});
      SceneRun run(scene, 1e-4, fixedSteps(1e-4) + "-scene_equilibrium -scene_page_frames 1 -scene_page " + file.name);
      must(run.solve());
      const std::size_t nodes = 5 * 9 - 3; /* corner nodes only */
      const PageFile    page(file.text(), 21, 0, {}, {{nodes, true}});
      for (double s : page.stress[0]) EXPECT_NEAR(s, 2400 / 0.06, 0.005 * 2400 / 0.06);
      double longer = 0;
      for (double x : page.moved[0]) longer = std::max(longer, x);
      if (law == FeLaw::Small) { EXPECT_NEAR(longer, 0.5 * 2 * 2400 / 0.06 / 2e6, 1e-4); }
    }
}
#endif
