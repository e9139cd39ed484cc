/*
  Damaged and absurd input for everything that reads files. An input is a handful of small files in a folder; it is made from
  a good one and a random number, so that (seed, number) name it for good, and read in a process of its own with bounds on
  time and memory. A reader may take it or refuse it with an error that names one of its files. It must not crash, hang, ask
  for memory out of proportion to the files, or take what no model can mean.
*/
#ifndef HHTDAE_TESTS_FUZZ_H
#define HHTDAE_TESTS_FUZZ_H

#include <cstdint>
#include <functional>
#include <petscsys.h>
#include <string>
#include <vector>

namespace hhtfuzz
{

/* splitmix64 */
class Random
{
public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();
  std::size_t   below(std::size_t n) { return n ? (std::size_t)(bits() % n) : 0; }
  bool          chance(double p) { return (double)(bits() >> 11) * 0x1p-53 < p; }
  template <class T> const T &of(const std::vector<T> &list) { return list[below(list.size())]; }

private:
  std::uint64_t state_;
};

struct File {
  std::string name, text;
  bool        binary = false;
  std::string bytes() const; /* as they are written: of a text without marks */
};

/* refuse: the reader must not take it, as it has no meaning */
struct Input {
  std::vector<File> files;
  bool              refuse = false;
  File             &file(const std::string &end); /* the one whose name ends so */
};

/* What a reader did with an input, as its process tells it */
struct Answer {
  PetscErrorCode code = 0;
  std::string    message;  /* of the error */
  std::string    nonsense; /* what it has taken, though nothing can mean it; "" if that is well */
  bool           named = true; /* the message has to name a file of the input */
};

struct Reader {
  std::string                                              name;
  std::function<std::vector<Input>()>                      good; /* inputs that have to be taken */
  std::function<Input(const std::vector<Input> &, Random &)> damage;
  std::function<void(const std::string &folder, Answer *)> read;
};

std::vector<Reader> &Readers();

/* A reader joins the list before main() begins */
struct Register {
  explicit Register(Reader reader) { Readers().push_back(std::move(reader)); }
};

/* ---- damage: mutate.cpp ---- */

/* Numbers that are read stand behind this sign in texts of good inputs; it is taken away before the files are written. */
constexpr char mark = '\x01';
/* All words of a text get the sign */
std::string Marked(const std::string &text);

/* One to four changes: bytes, words, lines, numbers */
void DamageText(std::string *text, Random &random);
void DamageBytes(std::string *bytes, Random &random);
/* What is no number in place of one that is read; false: there is none */
bool Poison(std::string *text, Random &random);
/* One file of an input, or a number that is read, damaged as text; the usual way */
Input DamageFiles(const std::vector<Input> &good, Random &random);

/* ---- a process of its own: process.cpp ---- */

struct Outcome {
  enum Kind { Taken, Refused, Crashed, Hung, Memory, Nonsense } kind = Taken;
  std::string text;
  double      cpu = 0, megabytes = 0; /* seconds; beyond what the process began with */
};
const char *NameOf(Outcome::Kind kind);

/* Writes the input's files to the folder and has them read */
Outcome Try(const Reader &reader, const Input &input, const std::string &folder);

/* While it lives, PETSc's errors are returned, and the first message is kept */
class Errors
{
public:
  explicit Errors(Answer *answer) { PetscPushErrorHandler(keep, answer); }
  ~Errors() { PetscPopErrorHandler(); }
  Errors(const Errors &) = delete;

private:
  static PetscErrorCode keep(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                             const char *message, void *ctx);
};

} // namespace hhtfuzz

#endif
