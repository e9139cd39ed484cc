/* Input decks of CalculiX with the matrices that it stores; and short decks that request much memory or time */
#include "fe_models.h"
#include "hhtdae/flexible.h"
#include <algorithm>
#include <cstdio>

namespace hhtfuzz
{

namespace
{

using namespace hhtdae;

void ReadDeck(const std::string &folder, Answer *a)
{
  FeModel model(PETSC_COMM_SELF);
  a->code = model.readCalculix(folder + "/job");
  if (!a->code) a->nonsense = Nonsense(model);
}

const char *const nodes_text = "*NODE, NSET=all\n@11,@0,@0,@0\n@12,@1.0D0,@0,@0\n@13,@0,@1.,@0\n@14,@0,@0,@+1e0\n@15,@1,@1,@1\n"
                               "@99,@5,@5,@5\n";
const char *const deck_text =
    "*HEADING\ntwo tetrahedra\n** a comment\n*INCLUDE, INPUT=nodes.inc\n*ELEMENT, TYPE=C3D4, ELSET=e\n@1,@11,@12,@13,@14\n"
    "@2,@12,@13,\n@14,@15\n*NSET, NSET=ends\n@11, @15\nall\n*NSET, NSET=range, GENERATE\n@11, @15, @2\n*ELSET, ELSET=some, GENERATE\n"
    "@1, @2\n*MATERIAL, NAME=Steel\n*ELASTIC\n@2.1D+3, @0.3\n*DENSITY\n@7.85\n*SOLID SECTION, ELSET=e,\nMATERIAL=Steel\n*STEP\n"
    "*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n";

std::string Template(std::string text)
{
  std::replace(text.begin(), text.end(), '@', mark);
  return text;
}

/* Lines "i j value" of the upper triangle, as ccx writes them */
std::string Matrix(double diagonal)
{
  std::string lines;
  char        line[80];
  for (int j = 1; j <= 15; j++)
    for (int i = std::max(1, j - 3); i <= j; i++) {
      std::snprintf(line, sizeof line, "\x01%d \x01%d \x01%20.13e\n", i, j, i == j ? diagonal : -0.1 * (double)(j - i));
      std::string spaced = line;
      const auto  at     = spaced.rfind(mark); /* the mark must be directly before the digits */
      const auto  digits = spaced.find_first_not_of(' ', at + 1);
      spaced.erase(at, 1);
      spaced.insert(digits - 1, 1, mark);
      lines += spaced;
    }
  return lines;
}

std::string Unknowns()
{
  std::string lines;
  for (int n = 11; n <= 15; n++)
    for (int c = 1; c <= 3; c++) lines += std::to_string(n) + "." + std::to_string(c) + "\n";
  return lines;
}

std::vector<Input> Good()
{
  return {{{{"job.inp", Template(deck_text)},
            {"nodes.inc", Template(nodes_text)},
            {"job.dof", Unknowns()},
            {"job.sti", Matrix(4)},
            {"job.mas", Matrix(2)}}}};
}

std::string Label(Random &r)
{
  static const std::vector<std::string> labels = {"1", "2", "11", "15", "99", "1000000", "2147483647", "2147483648", "0",
                                                  "99999999999999999", "123456789012345678"};
  return r.of(labels);
}

std::string Range(Random &r)
{
  return Label(r) + ", " + Label(r) + (r.chance(0.5) ? ", " + Label(r) : "") + "\n";
}

/* Sets of huge ranges, sets of sets that double each time, files that include one another */
Input Demanding(const std::vector<Input> &good, Random &r)
{
  Input             input = good.front();
  const std::string kind  = r.chance(0.5) ? "NSET" : "ELSET", begin = "*" + kind + ", " + kind + "=";
  std::string       more;
  switch (r.below(5)) {
  case 0:
    more = begin + "huge, GENERATE\n";
    for (std::size_t k = 1 + r.below(200); k > 0; k--) more += Range(r);
    break;
  case 1: { /* each set is several times the previous one */
    more = begin + "s0\n" + Label(r) + ", 1\n";
    if (r.chance(0.5)) more = begin + "s0, GENERATE\n" + Range(r);
    const std::size_t deep = 5 + r.below(60), times = 2 + r.below(6);
    for (std::size_t k = 1; k < deep; k++) {
      more += begin + "s" + std::to_string(k) + "\n";
      for (std::size_t t = 0; t < times; t++) more += "s" + std::to_string(k - 1) + (t + 1 < times ? ", " : "\n");
    }
    break;
  }
  case 2: { /* a tree of included files */
    const std::size_t files = 2 + r.below(12), times = 2 + r.below(12);
    for (std::size_t f = 0; f < files; f++) {
      std::string text = "*NSET, NSET=f" + std::to_string(f) + "\n11\n";
      for (std::size_t t = 0; t < times; t++)
        text += "*INCLUDE, INPUT=" + (r.chance(0.2) ? "./" : std::string()) + "f" + std::to_string((f + 1) % files + (r.chance(0.1) ? 1 : 0)) + ".inc\n";
      input.files.push_back({"f" + std::to_string(f) + ".inc", text});
    }
    more = "*INCLUDE, INPUT=f0.inc\n";
    break;
  }
  case 3: /* a keyword without an end */
    more = begin + "long,\n";
    for (std::size_t k = r.below(60000); k > 0; k--) more += r.chance(0.9) ? ",\n" : "x=1,\n";
    break;
  case 4: { /* names that are not files */
    static const std::vector<std::string> names = {"/dev/zero", "/dev/stdin", ".", "/", "job.inp", "", "/dev/tty", "nowhere"};
    more = "*INCLUDE, INPUT=" + r.of(names) + "\n";
    break;
  }
  }
  std::string &deck = input.file(".inp").text;
  deck.insert(r.chance(0.5) ? deck.find("*MATERIAL") : deck.find("*STEP"), more);
  return input;
}

Input Damage(const std::vector<Input> &good, Random &r) { return r.chance(0.2) ? Demanding(good, r) : DamageFiles(good, r); }

const Register decks({"calculix", Good, Damage, ReadDeck});

} // namespace

} // namespace hhtfuzz
