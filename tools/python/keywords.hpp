#pragma once

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "tools/python/work.hpp"

namespace stx::python {

/// The keywords of a call: those that were given are put into settings. stx/__init__.py says which
/// there are, their ranges and what they are without a value; here only None means that.
class Keywords {
  public:
    explicit Keywords(py::dict given) : given_(std::move(given)) {}

    /// What was given; nothing of None.
    [[nodiscard]] std::optional<py::object> find(const char* name) const {
        if (!given_.contains(name)) return std::nullopt;
        py::object value = given_[name];
        if (value.is_none()) return std::nullopt;
        return value;
    }

    /// A number, a truth or a text.
    template <class T>
    void take(const char* name, T& to) const {
        const auto value = find(name);
        if (!value) return;
        try {
            to = value->cast<T>();
        } catch (const py::cast_error&) {
            refuse("{} is {}; {} is expected", name, std::string(py::repr(*value)), wanted<T>());
        }
    }
    template <class T>
    void take(const char* name, std::optional<T>& to) const {
        if (!find(name)) return;
        T value{};
        take(name, value);
        to = value;
    }
    /// A number of degrees, as radians.
    void takeDegrees(const char* name, double& rad) const {
        std::optional<double> degrees;
        take(name, degrees);
        if (degrees) rad = glm::radians(*degrees);
    }

    /// One of some words.
    template <class E>
    void choose(const char* name, E& to,
                std::initializer_list<std::pair<const char*, E>> words) const {
        std::optional<std::string> word;
        take(name, word);
        if (!word) return;
        const auto* found = std::find_if(words.begin(), words.end(),
                                         [&](const auto& known) { return *word == known.first; });
        std::string all;
        for (const auto& known : words) all += (all.empty() ? "" : ", ") + std::string(known.first);
        if (found == words.end()) refuse("{} is '{}'; one of {} is expected", name, *word, all);
        to = found->second;
    }

  private:
    template <class T>
    static const char* wanted() {
        if constexpr (std::is_same_v<T, bool>) return "True or False";
        if constexpr (std::is_integral_v<T>) return "a whole number";
        if constexpr (std::is_floating_point_v<T>) return "a number";
        if constexpr (std::is_same_v<T, std::array<double, 2>>) return "two numbers";
        if constexpr (std::is_same_v<T, std::array<double, 4>>) return "four numbers";
        if constexpr (std::is_same_v<T, std::vector<std::string>>) return "a list of texts";
        if constexpr (std::is_same_v<T, std::vector<Camera>>) return "a list of stx.Camera";
        if constexpr (std::is_same_v<T, std::vector<Light>>) return "a list of stx.Light";
        return "a text";
    }

    py::dict given_;
};

}  // namespace stx::python
