/// XML of world files: a document in memory and typed values of its elements, with the line in every complaint.
/// Entities that a document declares are not expanded.
#pragma once

#include <tinyxml2.h>

#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "platform/sitl/world/byte_reader.hpp"

namespace roborun::sitl {

class Xml {
 public:
  using Element = tinyxml2::XMLElement;

  /// Throws InputError if it is no XML or its root is not `root`.
  Xml(std::span<const unsigned char> bytes, std::string name, const char* root)
      : name_(std::move(name)), document_(std::make_unique<tinyxml2::XMLDocument>()) {
    document_->Parse(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (document_->Error())
      throw InputError(fmt::format("{}:{}: not valid XML: {}", name_, document_->ErrorLineNum(),
                                   tinyxml2::XMLDocument::ErrorIDToName(document_->ErrorID())));
    root_ = document_->RootElement();
    if (root_ == nullptr || std::string_view(root_->Name()) != root)
      throw InputError(fmt::format("{}: must have <{}> as its root", name_, root));
  }

  [[nodiscard]] const Element& root() const { return *root_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[noreturn]] void refuse(const Element& at, const std::string& what) const {
    throw InputError(fmt::format("{}:{}: <{}>: {}", name_, at.GetLineNum(), at.Name(), what));
  }
  [[nodiscard]] const Element& need(const Element& of, const char* child) const {
    const Element* element = of.FirstChildElement(child);
    if (element == nullptr) refuse(of, fmt::format("must have <{}>", child));
    return *element;
  }
  [[nodiscard]] static std::string_view text(const Element& element) {
    const char* text = element.GetText();
    return text == nullptr ? std::string_view() : std::string_view(text);
  }
  /// Exactly `count` finite numbers of at most 1e6.
  template <std::size_t count>
  [[nodiscard]] std::array<double, count> numbers(const Element& element) const {
    std::string_view rest = text(element);
    std::array<double, count> values{};
    for (double& value : values) {
      const auto number = number_of<double>(WordReader::take_word(rest));
      if (!number || !(std::fabs(*number) <= 1e6)) refuse_count(element, count);
      value = *number;
    }
    if (!WordReader::take_word(rest).empty()) refuse_count(element, count);
    return values;
  }

 private:
  [[noreturn]] void refuse_count(const Element& element, std::size_t count) const {
    refuse(element, fmt::format("must be {} finite number{}, at most 1e6", count, count == 1 ? "" : "s"));
  }

  std::string name_;
  std::unique_ptr<tinyxml2::XMLDocument> document_;
  const Element* root_{nullptr};
};

}  // namespace roborun::sitl
