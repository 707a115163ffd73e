#include "formats/mpeg4/bifs/bifs_quantisation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace stx::mpeg4 {
namespace {

/// The fields of QuantizationParameter for a category: `prefix`Quant, Min, Max, NbBits.
std::string_view prefixOf(Quantisation category) {
    using enum Quantisation;
    switch (category) {
        case position3D:
            return "position3D";
        case position2D:
            return "position2D";
        case drawOrder:
            return "drawOrder";
        case color:
            return "color";
        case textureCoordinate:
            return "textureCoordinate";
        case angle:
            return "angle";
        case scale:
            return "scale";
        case key:
            return "key";
        case normal:
        case rotation:
            return "normal";
        case size3D:
        case size2D:
            return "size";
        default:
            return {};
    }
}

double component(const FieldValue& value, int i) {
    if (const auto* f = std::get_if<float>(&value)) return *f;
    if (const auto* v = std::get_if<glm::vec2>(&value)) return (*v)[std::min(i, 1)];
    if (const auto* v = std::get_if<glm::vec3>(&value)) return (*v)[i];
    return 0;
}

double steps(int bits) {
    return static_cast<double>((std::uint64_t{1} << bits) - 1);
}

/// A number in [-1, 1] in one bit of sign and the rest of size, biased.
float signedFrom(std::uint32_t code, int bits) {
    const std::int64_t half = std::int64_t{1} << (bits - 1);
    const std::int64_t value = static_cast<std::int64_t>(code) - half;
    return bits < 2 ? 0.0f : static_cast<float>(static_cast<double>(value) / steps(bits - 1));
}

/// Gives what is read back.
float writeSigned(BitWriter& out, int bits, double value) {
    const double half = static_cast<double>(std::int64_t{1} << (bits - 1));
    const double coded =
        bits < 2 ? half : half + std::round(std::clamp(value, -1.0, 1.0) * steps(bits - 1));
    const auto code = static_cast<std::uint32_t>(std::clamp(coded, 0.0, steps(bits)));
    out.write(code, bits);
    return signedFrom(code, bits);
}

constexpr double kQuarterPi = std::numbers::pi / 4;

/// A unit vector of `count` + 1 numbers from its `count` angles against the largest of them, in
/// quarters of pi.
template <int Count>
std::array<double, Count + 1> onSphere(int largest, const std::array<float, Count>& angles,
                                       double direction) {
    std::array<double, Count> tangents{};
    double length = 1;
    for (int i = 0; i < Count; ++i) {
        tangents[i] = std::tan(kQuarterPi * angles[i]);
        length += tangents[i] * tangents[i];
    }
    const double scale = direction / std::sqrt(length);
    std::array<double, Count + 1> vector{};
    vector[largest] = scale;
    for (int i = 0; i < Count; ++i) vector[(largest + i + 1) % (Count + 1)] = tangents[i] * scale;
    return vector;
}

template <int Count>
std::array<double, Count + 1> readOnSphere(BitReader& in, int bits, double direction) {
    const int largest = static_cast<int>(in.read(2)) % (Count + 1);
    std::array<float, Count> angles{};
    for (float& angle : angles) angle = signedFrom(in.read(bits), bits);
    return onSphere<Count>(largest, angles, direction);
}

template <int Count>
int largestOf(const std::array<double, Count + 1>& vector) {
    int largest = 0;
    // A later number must be clearly larger, so that rounding does not turn ties around.
    for (int i = 1; i <= Count; ++i)
        if (std::abs(vector[i]) > std::abs(vector[largest]) + 1e-6) largest = i;
    return largest;
}

/// Gives what is read back.
template <int Count>
std::array<double, Count + 1> writeOnSphere(BitWriter& out, int bits,
                                            const std::array<double, Count + 1>& vector,
                                            int largest, double direction) {
    out.write(static_cast<std::uint32_t>(largest), 2);
    std::array<float, Count> angles{};
    for (int i = 0; i < Count; ++i) {
        const double other = vector[(largest + i + 1) % (Count + 1)];
        const double base = vector[largest];
        angles[i] = writeSigned(out, bits, base == 0 ? 0 : std::atan(other / base) / kQuarterPi);
    }
    return onSphere<Count>(largest, angles, direction);
}

float linearFrom(std::uint32_t code, const QuantisedCoding& coding, int component) {
    const double low = coding.minimum[component];
    return static_cast<float>(low + (coding.maximum[component] - low) * code / steps(coding.bits));
}

glm::vec3 normalFrom(const std::array<double, 3>& v) {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// Of a quaternion w x y z.
Rotation rotationFrom(const std::array<double, 4>& q) {
    const double halfSine = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (halfSine < 1e-9) return {};
    Rotation rotation;
    rotation.axis = {static_cast<float>(q[1] / halfSine), static_cast<float>(q[2] / halfSine),
                     static_cast<float>(q[3] / halfSine)};
    rotation.angle = static_cast<float>(2 * std::atan2(halfSine, q[0]));
    return rotation;
}

}  // namespace

Result<std::optional<QuantisedCoding>> QuantisationScope::codingOf(const FieldInfo& field) const {
    if (!active_ || field.quantisation == Quantisation::none) return std::nullopt;
    using enum FieldType;
    const FieldType item = itemType(field.type);
    if (item != SFInt32 && item != SFFloat && item != SFVec2f && item != SFVec3f &&
        item != SFColor && item != SFRotation)
        return std::nullopt;

    QuantisedCoding coding;
    for (int i = 0; i < 3; ++i) {
        coding.minimum[i] = field.minimum;
        coding.maximum[i] = field.maximum;
    }
    if (field.quantisation == Quantisation::linear) {
        coding.kind = QuantisedCoding::Kind::linearInt;
        coding.bits = field.quantisationBits;
        // Without a bound the numbers are all of SFInt32.
        coding.minimum[0] = std::max(coding.minimum[0], -2147483648.0);
        return coding;
    }
    if (field.quantisation == Quantisation::coordIndex) {
        if (coordinates_ == 0)
            return fail(ErrorCode::invalidInput,
                        "{} is quantised by the number of coordinates, and none come before it",
                        field.name);
        coding.kind = QuantisedCoding::Kind::linearInt;
        coding.bits = significantBits(coordinates_);
        coding.minimum[0] = std::max(coding.minimum[0], -2147483648.0);
        return coding;
    }

    const std::string prefix(prefixOf(field.quantisation));
    if (prefix.empty()) return std::nullopt;
    if (!active_->get<bool>(prefix + "Quant")) return std::nullopt;
    coding.bits = active_->get<std::int32_t>(prefix + "NbBits");
    if (coding.bits < 1 || coding.bits > 31)
        return fail(ErrorCode::invalidInput,
                    "QuantizationParameter.{}NbBits is {}; 1 to 31 are possible", prefix,
                    coding.bits);
    if (prefix == "normal") {
        if (item == SFRotation)
            coding.kind = QuantisedCoding::Kind::rotation;
        else if (item == SFVec3f)
            coding.kind = QuantisedCoding::Kind::normal;
        else
            return std::nullopt;
        return coding;
    }
    if (item == SFRotation || item == SFInt32) return std::nullopt;
    const FieldValue& minimum = active_->value(prefix + "Min");
    const FieldValue& maximum = active_->value(prefix + "Max");
    for (int i = 0; i < 3; ++i) {
        coding.minimum[i] = std::max(coding.minimum[i], component(minimum, i));
        coding.maximum[i] = std::min(coding.maximum[i], component(maximum, i));
        if (!(coding.minimum[i] <= coding.maximum[i]))
            return fail(ErrorCode::invalidInput, "QuantizationParameter: {0}Min is above {0}Max",
                        prefix);
    }
    return coding;
}

void QuantisationScope::coded(const FieldInfo& field, const FieldValue& value) {
    if (field.nodeType != Ndt::SFCoordinateNode && field.nodeType != Ndt::SFCoordinate2DNode)
        return;
    const NodePtr* node = std::get_if<NodePtr>(&value);
    const int point = node && *node ? (*node)->info->find("point") : -1;
    if (point >= 0) coordinates_ = itemCount((*node)->value(point));
}

void QuantisationScope::ListGuard::coded(const NodePtr& item) {
    if (item && item->info->name == "QuantizationParameter") {
        scope_.active_ = item;
        local_ = item->get<bool>("isLocal");
    } else if (local_) {
        scope_.active_ = outer_;
        local_ = false;
    }
}

float readQuantised(BitReader& in, const QuantisedCoding& coding, int component) {
    return linearFrom(in.read(coding.bits), coding, component);
}

float writeQuantised(BitWriter& out, const QuantisedCoding& coding, int component, float value) {
    const double low = coding.minimum[component];
    const double range = coding.maximum[component] - low;
    const double share = range > 0 ? (static_cast<double>(value) - low) / range : 0;
    const double inside = std::isnan(share) ? 0 : share;  // of infinite bounds
    const auto code = static_cast<std::uint32_t>(std::round(inside * steps(coding.bits)));
    out.write(code, coding.bits);
    return linearFrom(code, coding, component);
}

glm::vec3 readQuantisedNormal(BitReader& in, const QuantisedCoding& coding) {
    const double direction = in.flag() ? -1 : 1;
    return normalFrom(readOnSphere<2>(in, coding.bits, direction));
}

glm::vec3 writeQuantisedNormal(BitWriter& out, const QuantisedCoding& coding,
                               const glm::vec3& normal) {
    const std::array<double, 3> v = {normal.x, normal.y, normal.z};
    const int largest = largestOf<2>(v);
    const bool turned = v[largest] < 0;
    out.flag(turned);
    return normalFrom(writeOnSphere<2>(out, coding.bits, v, largest, turned ? -1 : 1));
}

Rotation readQuantisedRotation(BitReader& in, const QuantisedCoding& coding) {
    return rotationFrom(readOnSphere<3>(in, coding.bits, 1));
}

Rotation writeQuantisedRotation(BitWriter& out, const QuantisedCoding& coding,
                                const Rotation& rotation) {
    const double length = std::sqrt(static_cast<double>(glm::dot(rotation.axis, rotation.axis)));
    const double half = rotation.angle / 2.0;
    const double scale = length > 0 ? std::sin(half) / length : 0;
    const std::array<double, 4> q = {std::cos(half), rotation.axis.x * scale,
                                     rotation.axis.y * scale, rotation.axis.z * scale};
    return rotationFrom(writeOnSphere<3>(out, coding.bits, q, largestOf<3>(q), 1));
}

float readEfficientFloat(BitReader& in) {
    const int mantissaLength = static_cast<int>(in.read(4));
    if (mantissaLength == 0) return 0;
    const int exponentLength = static_cast<int>(in.read(3));
    const std::uint32_t sign = in.read(1);
    const std::uint32_t mantissa = in.read(mantissaLength - 1);
    int exponent = 127;
    if (exponentLength > 0) {
        const bool negative = in.flag();
        const int size =
            static_cast<int>((1u << (exponentLength - 1)) | in.read(exponentLength - 1));
        exponent += negative ? -size : size;
    }
    return std::bit_cast<float>(sign << 31 | (static_cast<std::uint32_t>(exponent) & 0xFF) << 23 |
                                mantissa << 9);
}

float writeEfficientFloat(BitWriter& out, float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const int exponent = static_cast<int>(bits >> 23 & 0xFF) - 127;
    // Infinities have no code and become the largest number.
    if (bits == 0) {
        out.write(0, 4);
        return 0;
    }
    if (exponent == 128)
        return writeEfficientFloat(out, std::copysign(std::numeric_limits<float>::max(), value));
    const std::uint32_t mantissa = (bits & 0x7FFFFF) >> 9;
    const int mantissaBits = significantBits(mantissa);
    const auto size = static_cast<std::uint32_t>(std::abs(exponent));
    const int exponentBits = significantBits(size);
    out.write(static_cast<std::uint32_t>(mantissaBits + 1), 4);
    out.write(static_cast<std::uint32_t>(exponentBits), 3);
    out.write(bits >> 31, 1);
    out.write(mantissa, mantissaBits);
    if (exponentBits > 0) {
        out.flag(exponent < 0);
        out.write(size, exponentBits - 1);
    }
    return std::bit_cast<float>(bits >> 9 << 9);
}

}  // namespace stx::mpeg4
