// SPDX-License-Identifier: MIT
#include "descriptions/lexer.hpp"

#include <algorithm>

namespace cbcan::descriptions {

namespace {

/// Takes lines from the front of a text.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  bool at_end() const { return rest_.empty(); }
  /// The next line without its end.
  std::string_view take() {
    const auto end =
        static_cast<std::size_t>(std::min(next(feed_, '\n'), next(return_, '\r')) - rest_.data());
    const std::string_view line = rest_.substr(0, end);
    const std::size_t line_end = rest_.substr(end, 2) == "\r\n" ? 2 : 1;
    rest_.remove_prefix(std::min(end + line_end, rest_.size()));
    return line;
  }

 private:
  /// `known`: the result of the previous call.
  const char* next(const char*& known, char mark) const {
    if (known < rest_.data()) known = rest_.data() + std::min(rest_.find(mark), rest_.size());
    return known;
  }

  std::string_view rest_;
  const char* feed_ = nullptr;
  const char* return_ = nullptr;
};

/// Places of entries, sorted by the hashes of their keys.
using Order = std::vector<std::pair<std::uint64_t, std::size_t>>;

// Most files have at least so many.
constexpr std::size_t kBytesOfEntry = 20;
constexpr std::size_t kBytesOfSection = 120;

class Splitter {
 public:
  explicit Splitter(Findings& findings) : findings_(findings) {}

  Sections split(std::string_view text) {
    sections_.entries.reserve(text.size() / kBytesOfEntry);
    sections_.list.reserve(text.size() / kBytesOfSection);
    std::size_t number = 0;
    for (Lines lines(text); !lines.at_end();) {
      const std::string_view line = base::trim(lines.take());
      ++number;
      if (line.starts_with('['))
        begin_section(line.substr(1), number);
      else if (!line.empty() && line.front() != ';')
        take_entry(line, number);
    }
    end_section();
    for (std::size_t i = 0; i < sections_.list.size(); ++i) {
      const std::size_t end = i + 1 < firsts_.size() ? firsts_[i + 1] : sections_.entries.size();
      sections_.list[i].entries = std::span(sections_.entries).subspan(firsts_[i], end - firsts_[i]);
    }
    return std::move(sections_);
  }

 private:
  /// `text` is the line after its "[".
  void begin_section(std::string_view text, std::size_t line) {
    end_section();
    const std::size_t end = text.find(']');
    const std::string_view name = base::trim(text.substr(0, end));
    if (end == std::string_view::npos) {
      findings_.warning(line, "the section name has no \"]\": taken as {}", bracketed(name));
    } else if (const auto rest = base::trim(text.substr(end + 1)); !rest.empty() && rest.front() != ';') {
      findings_.warning(line, "{} after the section name is ignored", quoted(rest));
    }
    sections_.list.push_back({name, line, {}, 0});
    firsts_.push_back(sections_.entries.size());
    may_repeat_ = false;
  }

  void take_entry(std::string_view text, std::size_t line) {
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos) {
      findings_.warning(line, "{} is neither [section], key=value nor ;comment: ignored", quoted(text));
    } else if (firsts_.empty()) {
      findings_.warning(line, "{} comes before the first [section]: ignored", quoted(text));
    } else {
      const Key key(base::trim(text.substr(0, equals)));
      sections_.entries.push_back({key.text(), base::trim(text.substr(equals + 1)), line, key.hash()});
      std::uint64_t& seen = sections_.list.back().seen;
      may_repeat_ |= (seen & key.bit()) != 0;
      seen |= key.bit();
    }
  }

  /// Removes repeated keys.
  void end_section() {
    if (!may_repeat_) return;
    std::vector<KeyValue>& all = sections_.entries;
    order_.clear();
    for (std::size_t i = firsts_.back(); i < all.size(); ++i)
      order_.emplace_back(all[i].hash, i);
    std::ranges::sort(order_);
    const auto repeats = [&all](const auto& first, const auto& again) {
      return first.first == again.first && base::same_text(all[first.second].key, all[again.second].key);
    };
    bool found = false;
    for (std::size_t i = 1, first = 0; i < order_.size(); ++i) {
      if (!repeats(order_[first], order_[i])) {
        first = i;
        continue;
      }
      KeyValue& again = all[order_[i].second];
      findings_.warning(again.line, "key {} is here again: the value of line {} is used", quoted(again.key),
                        all[order_[first].second].line);
      again.line = 0;
      found = true;
    }
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(firsts_.back());
    if (found) all.erase(std::remove_if(begin, all.end(), [](auto& e) { return e.line == 0; }), all.end());
  }

  Findings& findings_;
  Sections sections_;
  std::vector<std::size_t> firsts_;  ///< of the entries of each section
  Order order_;
  bool may_repeat_ = false;  ///< two keys of the section have the same Key::bit()
};

}  // namespace

std::string to_string(const Diagnostic& diagnostic) {
  return fmt::format("{}:{}: {}", diagnostic.file, diagnostic.line, diagnostic.message);
}

std::string shortened(std::string_view text) {
  constexpr std::size_t kMessageBytes = 40;
  const std::string_view start = base::head(text, kMessageBytes);
  return base::to_utf8(start) + (start.size() < text.size() ? "..." : "");
}

std::string quoted(std::string_view text) {
  return '"' + shortened(text) + '"';
}

SectionName bracketed(std::string_view name) {
  return {'[' + shortened(name) + ']'};
}

void Findings::add(std::size_t line, Severity severity, std::string message) {
  if (diagnostics_.size() == kMost) {
    ++left_out_;
    return;
  }
  diagnostics_.push_back({file_, line, severity, std::move(message)});
}

void Findings::add_warning(std::size_t line, std::string message, const std::string& kind) {
  auto& [place, more, last_line] = kinds_.try_emplace(kind, Kind{diagnostics_.size()}).first->second;
  if (place == diagnostics_.size()) return add(line, Severity::kWarning, std::move(message));
  Diagnostic& first = diagnostics_[place];
  last_line = std::max({last_line, first.line, line});
  ++more;
  if (line < first.line) first = {file_, line, Severity::kWarning, std::move(message)};
}

std::vector<Diagnostic> Findings::take() {
  for (const auto& [kind, seen] : std::exchange(kinds_, {}))
    if (seen.more > 0)
      diagnostics_[seen.first].message +=
          fmt::format("; {} more like this, up to line {}", seen.more, seen.last_line);
  std::ranges::stable_sort(diagnostics_, {}, &Diagnostic::line);
  if (left_out_ > 0) {
    const std::size_t last_line = diagnostics_.back().line;
    diagnostics_.push_back({file_, last_line, Severity::kError, fmt::format("and {} more", left_out_)});
  }
  return std::exchange(diagnostics_, {});
}

const KeyValue* Section::find(const Key& key) const {
  if ((seen & key.bit()) == 0) return nullptr;
  for (const KeyValue& entry : entries)
    if (entry.hash == key.hash() && key.is(entry.key)) return entry.value.empty() ? nullptr : &entry;
  return nullptr;
}

Sections split_sections(std::string_view text, Findings& findings) {
  return Splitter(findings).split(text);
}

}  // namespace cbcan::descriptions
