/* Damage to texts and bytes. */
#include "fuzz.h"
#include <algorithm>
#include <cstring>

namespace hhtfuzz
{

std::uint64_t Random::bits()
{
  std::uint64_t x = (state_ += 0x9e3779b97f4a7c15ull);
  x               = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x               = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

File &Input::file(const std::string &end)
{
  for (File &f : files)
    if (f.name.size() >= end.size() && !f.name.compare(f.name.size() - end.size(), end.size(), end)) return f;
  return files.front();
}

namespace
{

std::string WithoutMarks(const std::string &text)
{
  std::string plain = text;
  plain.erase(std::remove(plain.begin(), plain.end(), mark), plain.end());
  return plain;
}

const char *const between = " \t\r\n,=";

struct Span {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

std::vector<Span> Words(const std::string &text)
{
  std::vector<Span> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(between, at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(between, at), text.size());
    words.push_back({at, end});
    at = end;
  }
  return words;
}

std::vector<Span> Lines(const std::string &text)
{
  std::vector<Span> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t newline = text.find('\n', at), end = newline == std::string::npos ? text.size() : newline + 1;
    lines.push_back({at, end});
    at = end;
  }
  return lines;
}

std::string Cut(const std::string &text, Span s) { return text.substr(s.begin, s.size()); }

/* The later span is replaced first, so that positions stay valid */
void Swap(std::string *text, Span a, Span b)
{
  if (a.begin > b.begin) std::swap(a, b);
  if (a.end > b.begin) return;
  const std::string first = Cut(*text, a), second = Cut(*text, b);
  text->replace(b.begin, b.size(), first);
  text->replace(a.begin, a.size(), second);
}

const std::vector<std::string> numbers = {"0", "-1", "1", "-0", "1e400", "-1e400", "1e-400", "1e308", "-1e308", "nan", "inf",
                                          "2147483647", "2147483648", "-2147483648", "4294967295", "4294967296",
                                          "536870912", "1073741824", "9223372036854775807", "-9223372036854775808",
                                          "99999999999999999999", "0.05abc", "5.0D-2", "1e", "0x10", "3", "1000000", "",
                                          "1e17", "7.5", "+2", "1D400", "*", "$Nodes", "%", "GENERATE"};

const std::vector<std::string> no_numbers = {"1e400", "-1e999", "1D400", "nan", "NaN", "inf", "-inf", "infinity", "0x10",
                                             "0x1p3", "1e", "1e+", "0.05abc", "1..2", "--1", "+-1", "1_000", "1e5e5",
                                             "5.0D-2x", "0.1D", ".", "-", "e5", "1e1.5", "1-5", "one", "1;2", "1e5D2"};

void OneChange(std::string *text, Random &r)
{
  const std::vector<Span> lines = Lines(*text), words = Words(*text);
  if (text->empty() || words.empty()) return DamageBytes(text, r);
  const Span line = r.of(lines), word = r.of(words);
  switch (r.below(14)) {
  case 0:
    (*text)[r.below(text->size())] = (char)r.below(256);
    break;
  case 1:
    text->resize(r.below(text->size()));
    break;
  case 2:
    text->erase(line.begin, line.size());
    break;
  case 3:
    text->insert(line.end, Cut(*text, line));
    break;
  case 4:
    Swap(text, line, r.of(lines));
    break;
  case 5:
  case 6:
  case 7:
    text->replace(word.begin, word.size(), r.of(numbers));
    break;
  case 8:
    Swap(text, word, r.of(words));
    break;
  case 9:
    text->erase(word.begin, word.size());
    break;
  case 10:
    text->insert(word.end, std::string(1 + r.below(3), r.of(std::vector<char>{'0', '9', '.', 'e', 'D', '-', 'x', ',', '"', '\0', '*', '\n'})));
    break;
  case 11: { /* a line repeated many times */
    std::string       many;
    const std::string one = Cut(*text, line);
    for (std::size_t k = r.below(2000); k > 0; k--) many += one;
    text->insert(line.end, many);
    break;
  }
  case 12: { /* moved from one place to another */
    const Span from = r.of(lines);
    text->insert(line.end, text->substr(from.begin, from.size() * (1 + r.below(4))));
    break;
  }
  case 13: { /* a count or label changed to a nearby value */
    const std::string s = WithoutMarks(Cut(*text, word));
    if (s.size() < 9 && s.find_first_not_of("0123456789") == std::string::npos)
      text->replace(word.begin, word.size(), std::to_string(std::stol("0" + s) + (long)r.below(5) - 2));
    break;
  }
  }
}

/* An extreme value as a word of a binary file, in either byte order */
std::string Extreme(Random &r)
{
  static const std::vector<std::uint64_t> words = {0, 1, ~0ull, 0x7fffffff, 0x80000000, 0x7fffffffffffffff, 0x8000000000000000,
                                                   0x7ff8000000000000 /* NaN */, 0x7ff0000000000000 /* inf */,
                                                   0xbff0000000000000 /* -1 */, 0x7fefffffffffffff, 0x20000000, 0x100000000};
  const std::uint64_t word   = r.of(words);
  const std::size_t   length = r.chance(0.5) ? 4 : 8;
  std::string         bytes(reinterpret_cast<const char *>(&word), length);
  if (length == 4 && r.chance(0.5)) { /* the upper half */
    const std::uint64_t upper = word >> 32;
    bytes.assign(reinterpret_cast<const char *>(&upper), 4);
  }
  if (r.chance(0.5)) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

} // namespace

std::string File::bytes() const { return binary ? text : WithoutMarks(text); }

std::string Marked(const std::string &text)
{
  std::string marked = text;
  const auto  words  = Words(text);
  for (std::size_t k = words.size(); k-- > 0;) marked.insert(words[k].begin, 1, mark);
  return marked;
}

void DamageText(std::string *text, Random &r)
{
  for (std::size_t k = r.chance(0.5) ? 1 : 1 + r.below(4); k > 0; k--) OneChange(text, r);
}

void DamageBytes(std::string *bytes, Random &r)
{
  for (std::size_t k = r.chance(0.5) ? 1 : 1 + r.below(4); k > 0; k--) {
    if (bytes->empty()) {
      *bytes = Extreme(r);
      continue;
    }
    const std::size_t at = r.below(bytes->size());
    switch (r.below(7)) {
    case 0:
      (*bytes)[at] = (char)((*bytes)[at] ^ (1 << r.below(8)));
      break;
    case 1:
      (*bytes)[at] = (char)r.below(256);
      break;
    case 2:
      bytes->resize(at);
      break;
    case 3:
      bytes->erase(at, 1 + r.below(16));
      break;
    case 4:
      bytes->insert(at, bytes->substr(r.below(bytes->size()), 1 + r.below(64)));
      break;
    default: { /* mostly near the beginning, where sizes are, and at words */
      const std::string word  = Extreme(r);
      const std::size_t place = (r.chance(0.4) ? r.below(std::min<std::size_t>(64, bytes->size())) : at) & ~(std::size_t)3;
      bytes->replace(place, std::min(word.size(), bytes->size() - place), word);
    }
    }
  }
}

bool Poison(std::string *text, Random &r)
{
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < text->size(); k++)
    if ((*text)[k] == mark) places.push_back(k);
  if (places.empty()) return false;
  const std::size_t at = r.of(places) + 1, end = std::min(text->find_first_of(between, at), text->size());
  text->replace(at, end - at, r.of(no_numbers));
  return true;
}

Input DamageFiles(const std::vector<Input> &good, Random &r)
{
  Input input = r.of(good);
  if (r.chance(0.2)) {
    File &file   = input.files[r.below(input.files.size())];
    input.refuse = !file.binary && Poison(&file.text, r);
    if (input.refuse) return input;
  }
  for (std::size_t k = r.chance(0.7) ? 1 : 2; k > 0; k--) {
    File &file = input.files[r.below(input.files.size())];
    file.binary ? DamageBytes(&file.text, r) : DamageText(&file.text, r);
  }
  return input;
}

} // namespace hhtfuzz
