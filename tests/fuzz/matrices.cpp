/* Matrices in Matrix Market's format, in plain text and in PETSc's, with lists of nodes and sets. */
#include "fe_models.h"
#include "hhtdae/flexible.h"
#include <algorithm>
#include <cstring>

namespace hhtfuzz
{

namespace
{

using namespace hhtdae;

void ReadMatrices(const std::string &folder, Answer *a)
{
  FeModel model(PETSC_COMM_SELF);
  a->code = model.readMatrices(folder + "/k", folder + "/m", folder + "/nodes", folder + "/sets");
  if (!a->code) a->nonsense = Nonsense(model);
}

const char *const nodes_text = "# nodes\n@7 @0 @0 @0\n\n@5, @1, @2.5, @-3e-2\n", *const sets_text = "left @7\nboth @5 @7\nleft @7\n";

std::string Template(std::string text)
{
  std::replace(text.begin(), text.end(), '@', mark);
  return text;
}

std::vector<Input> GoodText()
{
  const std::string market = Template("%%MatrixMarket matrix coordinate real symmetric\n% a spring\n@6 @6 @12\n@1 @1 @4\n@2 @2 "
                                      "@4\n@3 @3 @4\n@4 @4 @4\n@5 @5 @4.0E0\n@6 @6 @4\n@4 @1 @-1\n@5 @2 @-1\n@6 @3 @-1\n@2 @1 "
                                      "@0.5\n@5 @4 @0.5\n@6 @5 @0.25\n"),
                    general = Template("%%MatrixMarket matrix coordinate real general\n@6 @6 @8\n@1 @1 @4\n@2 @2 @4\n@3 @3 "
                                       "@4\n@4 @4 @4\n@5 @5 @4\n@6 @6 @4\n@2 @1 @1\n@1 @2 @1\n"),
                    plain = Template("@1 @1 @1\n@2 @2 @1\n@3, @3, @1\n@4 @4 @2\n@5 @5 @2.0D+0\n@6 @6 @+2\n"),
                    nodes = Template(nodes_text), sets = Template(sets_text);
  return {{{{"k", market}, {"m", plain}, {"nodes", nodes}, {"sets", sets}}},
          {{{"k", general}, {"m", market}, {"nodes", nodes}, {"sets", sets}}}};
}

/* Big-endian, as PETSc writes */
template <class T> void Append(std::string *to, T value)
{
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
#if !defined(PETSC_WORDS_BIGENDIAN)
  std::reverse(bytes, bytes + sizeof value);
#endif
  to->append(bytes, sizeof value);
}

/* A band of three */
std::string Binary(PetscInt n)
{
  std::string               bytes;
  std::vector<PetscInt>     length, column;
  std::vector<PetscScalar>  value;
  for (PetscInt i = 0; i < n; i++) {
    length.push_back(0);
    for (PetscInt j = std::max<PetscInt>(0, i - 1); j < std::min(n, i + 2); j++, length.back()++) {
      column.push_back(j);
      value.push_back(i == j ? 4 : -1);
    }
  }
  Append(&bytes, (int)1211216);
  for (PetscInt head : {n, n, (PetscInt)column.size()}) Append(&bytes, head);
  for (PetscInt l : length) Append(&bytes, l);
  for (PetscInt c : column) Append(&bytes, c);
  for (PetscScalar v : value) Append(&bytes, v);
  return bytes;
}

std::vector<Input> GoodBinary()
{
  const std::string nodes = Template(nodes_text), sets = Template(sets_text);
  return {{{{"k", Binary(6), true}, {"m", Binary(6), true}, {"nodes", nodes}, {"sets", sets}}}};
}

Input DamageBinary(const std::vector<Input> &good, Random &r)
{
  Input input = r.of(good);
  DamageBytes(&input.files[r.below(2)].text, r);
  return input;
}

const Register text({"matrices", GoodText, DamageFiles, ReadMatrices}),
    binary({"petscbinary", GoodBinary, DamageBinary, ReadMatrices});

} // namespace

} // namespace hhtfuzz
