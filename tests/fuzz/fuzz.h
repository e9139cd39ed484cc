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
  std::string bytes() const; /* the bytes written to the file: the text without marks */
};

/* refuse: the reader must refuse the input, because it has no meaning */
struct Input {
  std::vector<File> files;
  bool              refuse = false;
  File             &file(const std::string &end); /* the file whose name ends with `end` */
};

/* The reader's reaction to an input, as reported by its process */
struct Answer {
  PetscErrorCode code = 0;
  std::string    message;  /* error message */
  std::string    nonsense; /* accepted content that no valid model can contain; "" if there is none */
  bool           named = true; /* the message must name a file of the input */
};

struct Reader {
  std::string                                              name;
  std::function<std::vector<Input>()>                      good; /* valid inputs, which must be accepted */
  std::function<Input(const std::vector<Input> &, Random &)> damage;
  std::function<void(const std::string &folder, Answer *)> read;
};

std::vector<Reader> &Readers();

/* Adds a reader to the list before main() begins */
struct Register {
  explicit Register(Reader reader) { Readers().push_back(std::move(reader)); }
};

/* ---- damage: mutate.cpp ---- */

/* In the texts of valid inputs this sign precedes every number that the reader reads; it is removed before the files
   are written */
constexpr char mark = '\x01';
/* Marks all words of a text */
std::string Marked(const std::string &text);

/* Applies one to four changes of bytes, words, lines or numbers */
void DamageText(std::string *text, Random &random);
void DamageBytes(std::string *bytes, Random &random);
/* Replaces a number that is read by text that is not a number; false: there is none */
bool Poison(std::string *text, Random &random);
/* The usual damage: one file of an input is changed as text, or one number that is read is replaced */
Input DamageFiles(const std::vector<Input> &good, Random &random);

/* ---- separate processes: process.cpp ---- */

struct Outcome {
  enum Kind { Taken, Refused, Crashed, Hung, Memory, Nonsense } kind = Taken;
  std::string text;
  double      cpu = 0, megabytes = 0; /* seconds; memory in addition to that at the start of the process */
};
const char *NameOf(Outcome::Kind kind);

/* Writes the input's files to the folder and calls the reader */
Outcome Try(const Reader &reader, const Input &input, const std::string &folder);

/* During its lifetime PETSc's errors are returned, and the first message is stored */
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
