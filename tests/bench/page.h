/*
  A report as one HTML page that needs nothing else: text, tables, and pictures that gnuplot draws and the page holds.

    Page page("Error against run time");
    page.section("Chains");
    page.table({"solver", "time"}, {{"hhtdae", "1.0"}, {"BDF", "4.0"}});
    page.plot("plot 'run.csv' using 1:2 with lines", "The tip over time");
    page.write("report.html");
*/
#ifndef HHTDAE_BENCH_PAGE_H
#define HHTDAE_BENCH_PAGE_H

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <petscsys.h>
#include <sstream>
#include <string>
#include <unistd.h>
#include <vector>

namespace hhtbench
{

/* printf() into a string */
template <class... Args> std::string Text(const char *format, Args... args)
{
  const int         n = std::snprintf(nullptr, 0, format, args...);
  std::string       s((std::size_t)n + 1, '\0');
  std::snprintf(&s[0], s.size(), format, args...);
  s.resize((std::size_t)n);
  return s;
}

class Page
{
public:
  using Row = std::vector<std::string>;

  explicit Page(const std::string &title) : title_(title) {}

  void section(const std::string &title) { body_ << "<h2>" << escaped(title) << "</h2>\n"; }
  void subsection(const std::string &title) { body_ << "<h3>" << escaped(title) << "</h3>\n"; }
  void text(const std::string &paragraph) { body_ << "<p>" << escaped(paragraph) << "</p>\n"; }
  void code(const std::string &lines) { body_ << "<pre>" << escaped(lines) << "</pre>\n"; }

  /* The first column is aligned left, the others right; a row that begins with '!' is highlighted as a failure */
  void table(const Row &head, const std::vector<Row> &rows, const std::string &caption = "")
  {
    body_ << "<div class='wide'><table>";
    if (!caption.empty()) body_ << "<caption>" << escaped(caption) << "</caption>";
    body_ << "<tr>";
    for (std::size_t k = 0; k < head.size(); k++)
      body_ << (k && !rows.empty() && k < rows[0].size() && isNumber(rows[0][k]) ? "<th class='n'>" : "<th>") << escaped(head[k]) << "</th>";
    body_ << "</tr>\n";
    for (const Row &row : rows) addRow(row);
    body_ << "</table></div>\n";
  }

  /* Embeds a PNG file in the page */
  PetscErrorCode picture(const std::string &file, const std::string &caption)
  {
    PetscFunctionBegin;
    std::ifstream      in(file, std::ios::binary);
    std::ostringstream data;
    data << in.rdbuf();
    PetscCheck(in && !data.str().empty(), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "The picture %s for the report cannot be read", file.c_str());
    body_ << "<figure><img alt='" << escaped(caption) << "' src='data:image/png;base64," << base64(data.str()) << "'><figcaption>" << escaped(caption)
          << "</figcaption></figure>\n";
    PetscFunctionReturn(0);
  }

  /* Embeds a whole HTML page in this one */
  PetscErrorCode frame(const std::string &file, const std::string &caption)
  {
    PetscFunctionBegin;
    std::ifstream      in(file, std::ios::binary);
    std::ostringstream data;
    data << in.rdbuf();
    PetscCheck(in && !data.str().empty(), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "The page %s for the report cannot be read", file.c_str());
    body_ << "<figure class='wide'><iframe title='" << escaped(caption) << "' srcdoc='" << escaped(data.str()) << "'></iframe><figcaption>" << escaped(caption)
          << "</figcaption></figure>\n";
    PetscFunctionReturn(0);
  }

  /* Runs gnuplot's commands and embeds the drawing as SVG of the given size; without gnuplot the caption says so */
  PetscErrorCode plot(const std::string &commands, const std::string &caption, int width = 900, int height = 480)
  {
    PetscFunctionBegin;
    if (std::system("command -v gnuplot >/dev/null 2>&1")) {
      text(caption + " (not drawn: gnuplot is not installed, Debian: gnuplot-nox)");
      PetscFunctionReturn(0);
    }
    char      name[] = "/tmp/hhtdae_plot_XXXXXX";
    const int fd     = mkstemp(name);
    PetscCheck(fd >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "No temporary file can be made in /tmp");
    close(fd);
    FILE *g = popen("gnuplot", "w");
    PetscCheck(g, PETSC_COMM_SELF, PETSC_ERR_SYS, "gnuplot could not be started");
    std::fprintf(g, "set terminal svg size %d,%d dynamic font 'sans,13' background '#ffffff' name 'p%d'\nset output '%s'\n%s\n", width, height, ++plots_, name,
                 commands.c_str());
    const int         failed = pclose(g);
    std::ifstream     in(name);
    std::stringstream svg;
    svg << in.rdbuf();
    std::remove(name);
    const std::string drawing = svg.str();
    const std::size_t start   = drawing.find("<svg");
    PetscCheck(!failed && start != std::string::npos, PETSC_COMM_SELF, PETSC_ERR_LIB, "gnuplot failed on the picture \"%s\"", caption.c_str());
    body_ << "<figure>" << drawing.substr(start) << "<figcaption>" << escaped(caption) << "</figcaption></figure>\n";
    PetscFunctionReturn(0);
  }

  PetscErrorCode write(const std::string &file) const
  {
    PetscFunctionBegin;
    std::ofstream out(file);
    out << "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><title>" << escaped(title_)
        << "</title>\n<meta name='viewport' content='width=device-width,initial-scale=1'>\n"
           "<style>body{font:16px/1.5 sans-serif;max-width:68em;margin:2em auto;padding:0 1em;color:#222}"
           "h1{font-size:1.7em}h2{margin-top:2em;border-bottom:1px solid #ccc}table{border-collapse:collapse;margin:1em 0;font-size:.88em}"
           "caption{text-align:left;font-weight:bold;padding:.3em 0}th,td{padding:.25em .6em;border-bottom:1px solid #ddd;text-align:left;white-space:nowrap}"
           "th{border-bottom:2px solid #888;white-space:normal;vertical-align:bottom;min-width:4em}td:first-child{white-space:normal;min-width:9em}td.n,th.n{text-align:right}td.n{font-variant-numeric:tabular-nums}tr.bad td{background:#fdd}.wide{overflow-x:auto;width:max-content;min-width:100%;max-width:calc(100vw - 3em);"
           "position:relative;left:50%;transform:translateX(-50%)}iframe{display:block;width:min(72em,calc(100vw - 3em));height:min(46em,92vh);"
           "border:1px solid #ccc;border-radius:8px}"
           "figure{margin:1.5em 0}figcaption{color:#555;font-size:.9em}img,svg{max-width:100%;height:auto}pre{background:#f4f4f4;padding:.6em;overflow-x:auto}"
           "@media(prefers-color-scheme:dark){body{background:#14181f;color:#e6e9ee}h2,th,td,iframe{border-color:#3a424d}a{color:#7ab0ff}tr.bad td{background:#5a2020}"
           "figcaption{color:#aab2bd}pre{background:#232a33}img,svg{background:#fff;border-radius:4px}}"
           "</style></head>\n<body><h1>"
        << escaped(title_) << "</h1>\n"
        << body_.str() << "</body></html>\n";
    out.close();
    PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "The report %s cannot be written", file.c_str());
    PetscFunctionReturn(0);
  }

private:
  std::string        title_;
  std::ostringstream body_;
  int                plots_ = 0;

  static std::string escaped(const std::string &s)
  {
    std::string r;
    for (char c : s) {
      if (c == '<') r += "&lt;";
      else if (c == '>') r += "&gt;";
      else if (c == '&') r += "&amp;";
      else if (c == '\'') r += "&#39;";
      else r += c;
    }
    return r;
  }

  static bool isNumber(const std::string &s)
  {
    const std::size_t k = s.find_first_not_of("+-");
    return s == "-" || (k != std::string::npos && std::isdigit((unsigned char)s[k]));
  }

  void addRow(const Row &row)
  {
    const bool bad = !row.empty() && !row[0].empty() && row[0][0] == '!';
    body_ << (bad ? "<tr class='bad'>" : "<tr>");
    for (std::size_t k = 0; k < row.size(); k++)
      body_ << (k && isNumber(row[k]) ? "<td class='n'>" : "<td>") << escaped(k == 0 && bad ? row[k].substr(1) : row[k]) << "</td>";
    body_ << "</tr>\n";
  }

  static std::string base64(const std::string &data)
  {
    static const char *const digit = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string              r;
    for (std::size_t i = 0; i < data.size(); i += 3) {
      unsigned bits = 0;
      for (std::size_t k = 0; k < 3; k++) bits = bits << 8 | (i + k < data.size() ? (unsigned char)data[i + k] : 0u);
      for (std::size_t k = 0; k < 4; k++) r += i + k > data.size() ? '=' : digit[bits >> (18 - 6 * k) & 63];
    }
    return r;
  }
};

} // namespace hhtbench

#endif
