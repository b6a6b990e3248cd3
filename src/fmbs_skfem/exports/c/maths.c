//: size_of
static double size_of(double x) { return x < 0.0 ? -x : x; }

//: is_finite
static int is_finite(double x) { return x - x == 0.0; }

//: math_floor
static double math_floor(double x)
{
    const double big = 4503599627370496.0; /* 2^52: numbers beyond are whole */
    if (!(size_of(x) < big))
        return x;
    const double whole = (double)(long long)x;
    return whole > x ? whole - 1.0 : whole;
}

//: math_round math_floor
/* The nearest whole number, the even one of two. */
static double math_round(double x)
{
    const double low = math_floor(x), rest = x - low;
    if (rest != 0.5)
        return rest < 0.5 ? low : low + 1.0;
    return low - 2.0 * math_floor(0.5 * low) == 0.0 ? low : low + 1.0;
}

//: bits_of
/* A number as its 64 bits, and back: exponents are read and written without the library. */
static unsigned long long bits_of(double x)
{
    union { double number; unsigned long long bits; } both;
    both.number = x;
    return both.bits;
}

//: of_bits
static double of_bits(unsigned long long bits)
{
    union { double number; unsigned long long bits; } both;
    both.bits = bits;
    return both.number;
}

//: math_sqrt bits_of of_bits
#if defined(__NO_MATH_ERRNO__) && (defined(__x86_64__) || defined(__aarch64__) || defined(__wasm__))
/* One instruction there, no call of a library. */
INLINED double math_sqrt(double x) { return __builtin_sqrt(x); }
#else
/* 1 / sqrt(x) from half the exponent by Newton's iteration, then x - s^2 without round-off. */
static double math_sqrt(double x)
{
    double scale = 1.0;
    if (!(x > 0.0) || x - x != 0.0)
        return x < 0.0 ? (x - x) / (x - x) : x;
    if (x < 1e-290) {
        x *= 18446744073709551616.0; /* 2^64 */
        scale = 2.3283064365386963e-10; /* 2^-32 */
    } else if (x > 1e290) {
        x *= 5.421010862427522e-20; /* 2^-64 */
        scale = 4294967296.0; /* 2^32 */
    }
    double y = of_bits(0x5fe6eb50c7b537a9ULL - (bits_of(x) >> 1));
    y *= 1.5 - 0.5 * x * y * y;
    y *= 1.5 - 0.5 * x * y * y;
    y *= 1.5 - 0.5 * x * y * y;
    y *= 1.5 - 0.5 * x * y * y;
    const double s = x * y, split = 134217729.0 * s; /* 2^27 + 1 */
    const double high = split - (split - s), low = s - high;
    return scale * (s + 0.5 * y * (((x - high * high) - 2.0 * high * low) - low * low));
}
#endif

//: least
/* As `min` and `max` of Python: the first number stays where the second is none. */
static double least(double a, double b) { return b < a ? b : a; }

//: most
static double most(double a, double b) { return b > a ? b : a; }

//: least_whole
static whole least_whole(whole a, whole b) { return b < a ? b : a; }

//: most_whole
static whole most_whole(whole a, whole b) { return b > a ? b : a; }

//: size_whole
static whole size_whole(whole a) { return a < 0 ? -a : a; }

//: quotient
/* As // and % of Python, towards minus infinity. */
static whole quotient(whole a, whole b) { return a / b - (a % b != 0 && (a < 0) != (b < 0)); }

//: remainder_of quotient
static whole remainder_of(whole a, whole b) { return a - b * quotient(a, b); }

//: pair_of
INLINED pair pair_of(double real, double imag)
{
    const pair found = {real, imag};
    return found;
}

//: pair_sum pair_of
INLINED pair pair_sum(pair a, pair b) { return pair_of(a.real + b.real, a.imag + b.imag); }

//: pair_difference pair_of
INLINED pair pair_difference(pair a, pair b) { return pair_of(a.real - b.real, a.imag - b.imag); }

//: pair_product pair_of
INLINED pair pair_product(pair a, pair b)
{
    return pair_of(a.real * b.real - a.imag * b.imag, a.real * b.imag + a.imag * b.real);
}

//: pair_quotient pair_of size_of
/* By the larger part of b, so that its square neither overflows nor vanishes. */
static pair pair_quotient(pair a, pair b)
{
    if (size_of(b.real) >= size_of(b.imag)) {
        const double ratio = b.imag / b.real, below = b.real + b.imag * ratio;
        return pair_of((a.real + a.imag * ratio) / below, (a.imag - a.real * ratio) / below);
    }
    const double ratio = b.real / b.imag, below = b.real * ratio + b.imag;
    return pair_of((a.real * ratio + a.imag) / below, (a.imag * ratio - a.real) / below);
}

//: pair_minus pair_of
INLINED pair pair_minus(pair a) { return pair_of(-a.real, -a.imag); }

//: pair_conjugate pair_of
INLINED pair pair_conjugate(pair a) { return pair_of(a.real, -a.imag); }

//: pair_size math_sqrt
static double pair_size(pair a) { return math_sqrt(a.real * a.real + a.imag * a.imag); }

//: pair_sqrt pair_of pair_size math_sqrt size_of
static pair pair_sqrt(pair a)
{
    const double root = math_sqrt(0.5 * (size_of(a.real) + pair_size(a)));
    if (root == 0.0)
        return pair_of(0.0, 0.0);
    if (a.real >= 0.0)
        return pair_of(root, 0.5 * a.imag / root);
    return pair_of(0.5 * size_of(a.imag) / root, a.imag < 0.0 ? -root : root);
}

//: turn_back math_floor
/* x less the nearest multiple k of pi/2, as a sum of two numbers; k modulo 4. Right to round-off up to 8e5 rad. */
static int turn_back(double x, double *rest, double *tail)
{
    const double k = math_floor(x * 6.36619772367581382433e-01 + 0.5);
    double r = x - k * 1.57079632673412561417e+00, w = k * 6.07710050630396597660e-11;
    const double first = r;
    r = first - w;
    w = k * 2.02226624879595063154e-21 - ((first - r) - w);
    *rest = r - w;
    *tail = (r - *rest) - w;
    return (int)(k - 4.0 * math_floor(0.25 * k));
}

//: sine_near
/* sin(x + tail), |x| < pi/4; coefficients of fdlibm. */
static double sine_near(double x, double tail)
{
    const double z = x * x, v = z * x;
    const double r = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
    return x - ((z * (0.5 * tail - v * r) - tail) - v * -1.66666666666666324348e-01);
}

//: cosine_near
static double cosine_near(double x, double tail)
{
    const double z = x * x, half = 0.5 * z, w = 1.0 - half;
    const double r = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * (2.48015872894767294178e-05
        + z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
    return w + (((1.0 - w) - half) + (z * r - x * tail));
}

//: math_sin turn_back sine_near cosine_near is_finite
static double math_sin(double x)
{
    double r, tail;
    if (!is_finite(x))
        return x - x;
    const int k = turn_back(x, &r, &tail);
    const double value = k % 2 == 0 ? sine_near(r, tail) : cosine_near(r, tail);
    return k < 2 ? value : -value;
}

//: math_cos turn_back sine_near cosine_near is_finite
static double math_cos(double x)
{
    double r, tail;
    if (!is_finite(x))
        return x - x;
    const int k = turn_back(x, &r, &tail);
    const double value = k % 2 == 0 ? cosine_near(r, tail) : sine_near(r, tail);
    return k == 1 || k == 2 ? -value : value;
}

//: math_tan math_sin math_cos
static double math_tan(double x) { return math_sin(x) / math_cos(x); }

//: math_atan size_of
/* From the nearest of 0, atan 1/2, atan 1, atan 3/2 and pi/2; coefficients of fdlibm. */
static double math_atan(double value)
{
    static const double high[] = {4.63647609000806093515e-01, 7.85398163397448278999e-01, 9.82793723247329054082e-01,
                                  1.57079632679489655800e+00};
    static const double low[] = {2.26987774529616870924e-17, 3.06161699786838301793e-17, 1.39033110312309984516e-17,
                                 6.12323399573676603587e-17};
    double x = size_of(value);
    int near = -1;
    if (value != value)
        return value;
    if (x > 7.3e19)
        return value < 0.0 ? -high[3] : high[3];
    if (x >= 2.4375) {
        near = 3;
        x = -1.0 / x;
    } else if (x >= 1.1875) {
        near = 2;
        x = (x - 1.5) / (1.0 + 1.5 * x);
    } else if (x >= 0.6875) {
        near = 1;
        x = (x - 1.0) / (x + 1.0);
    } else if (x >= 0.4375) {
        near = 0;
        x = (2.0 * x - 1.0) / (2.0 + x);
    }
    const double z = x * x, w = z * z;
    const double odd = z * (3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * (9.09088713343650656196e-02
        + w * (6.66107313738753120669e-02 + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))));
    const double even = w * (-1.99999999998764832476e-01 + w * (-1.11111104054623557880e-01 + w * (-7.69187620504482999495e-02
        + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02))));
    const double found = near < 0 ? x - x * (odd + even) : high[near] - ((x * (odd + even) - low[near]) - x);
    return value < 0.0 ? -found : found;
}

//: math_atan2 math_atan bits_of
static double math_atan2(double y, double x)
{
    const double pi = 3.14159265358979311600e+00, rest = 1.2246467991473531772e-16;
    const int below = (int)(bits_of(y) >> 63), behind = (int)(bits_of(x) >> 63);
    if (x != x || y != y)
        return x + y;
    if (y == 0.0)
        return behind ? (below ? -pi : pi) : y;
    if (x == 0.0)
        return below ? -0.5 * pi : 0.5 * pi;
    const double a = math_atan(size_of(y / x)), found = behind ? pi - (a - rest) : a;
    return below ? -found : found;
}

//: math_asin math_atan2 math_sqrt
static double math_asin(double x) { return math_atan2(x, math_sqrt((1.0 - x) * (1.0 + x))); }

//: math_acos math_atan2 math_sqrt
static double math_acos(double x) { return math_atan2(math_sqrt((1.0 - x) * (1.0 + x)), x); }

//: math_exp math_floor of_bits
/* 2^k exp(r), |r| < ln 2 / 2; coefficients of fdlibm. */
static double math_exp(double x)
{
    if (x != x)
        return x;
    if (x > 709.782712893383973096)
        return 1e300 * 1e300;
    if (x < -745.2)
        return 0.0;
    const double k = math_floor(x * 1.44269504088896338700e+00 + 0.5);
    const double high = x - k * 6.93147180369123816490e-01, low = k * 1.90821492927058770002e-10, r = high - low, z = r * r;
    const double c = r - z * (1.66666666666666019037e-01 + z * (-2.77777777770155933842e-03 + z * (6.61375632143793436117e-05
        + z * (-1.65339022054652515390e-06 + z * 4.13813679705723846039e-08))));
    const double value = 1.0 - ((low - r * c / (2.0 - c)) - high);
    const long long whole = (long long)k, half = whole / 2;
    return value * of_bits((unsigned long long)(half + 1023) << 52) * of_bits((unsigned long long)(whole - half + 1023) << 52);
}

//: math_log bits_of of_bits
/* k ln 2 + log(1 + f) with sqrt(1/2) < 1 + f < sqrt(2); coefficients of fdlibm. */
static double math_log(double x)
{
    double k = 0.0;
    if (!(x > 0.0))
        return x == 0.0 ? -1e300 * 1e300 : (x - x) / (x - x);
    if (x - x != 0.0)
        return x;
    if (x < 2.2250738585072014e-308) {
        x *= 18014398509481984.0; /* 2^54 */
        k = -54.0;
    }
    const unsigned long long bits = bits_of(x) + (0x3ff0000000000000ULL - 0x3fe6a09e667f3bcdULL);
    k += (double)(long long)(bits >> 52) - 1023.0;
    const double f = of_bits((bits & 0xfffffffffffffULL) + 0x3fe6a09e667f3bcdULL) - 1.0;
    const double half = 0.5 * f * f, s = f / (2.0 + f), z = s * s, w = z * z;
    const double R = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01))
        + z * (6.666666666666735130e-01 + w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
    return k * 6.93147180369123816490e-01 - ((half - (s * (half + R) + k * 1.90821492927058770002e-10)) - f);
}

//: math_pow math_exp math_log math_floor
static double math_pow(double a, double b)
{
    if (b == 0.0 || a == 1.0)
        return 1.0;
    if (a < 0.0 && b == math_floor(b))
        return b - 2.0 * math_floor(0.5 * b) == 0.0 ? math_exp(b * math_log(-a)) : -math_exp(b * math_log(-a));
    if (a == 0.0)
        return b > 0.0 ? 0.0 : 1e300 * 1e300;
    return math_exp(b * math_log(a));
}

//: math_erf math_exp size_of
/* 2 / sqrt(pi) exp(-x^2) sum_n 2^n x^(2n+1) / (1 3 ... (2n+1)), whose terms have one sign. */
static double math_erf(double x)
{
    double term = x, sum = x;
    if (!(size_of(x) < 6.0))
        return x != x ? x : x > 0.0 ? 1.0 : -1.0;
    for (int n = 1; size_of(term) > 1e-17 * size_of(sum); n++) {
        term *= 2.0 * x * x / (2 * n + 1);
        sum += term;
    }
    return 1.12837916709551257390e+00 * math_exp(-x * x) * sum;
}

//: math_sinh math_exp size_of
static double math_sinh(double x)
{
    const double z = x * x;
    if (size_of(x) < 0.3)
        return x * (1.0 + z / 6.0 * (1.0 + z / 20.0 * (1.0 + z / 42.0 * (1.0 + z / 72.0 * (1.0 + z / 110.0 * (1.0 + z / 156.0))))));
    return 0.5 * (math_exp(x) - math_exp(-x));
}

//: math_cosh math_exp
static double math_cosh(double x) { return 0.5 * (math_exp(x) + math_exp(-x)); }

//: math_tanh math_sinh math_cosh size_of
static double math_tanh(double x)
{
    if (size_of(x) > 20.0)
        return x < 0.0 ? -1.0 : 1.0;
    return math_sinh(x) / math_cosh(x);
}

//: math_sign
static double math_sign(double x) { return (double)(x > 0.0) - (double)(x < 0.0); }

//: continued math_round
/* An angle known but for whole turns, the one nearest to its last value [rad]. */
static double continued(double value, double last)
{
    const double turn = 6.28318530717958623200e+00, off = value - last;
    return last + (off - turn * math_round(off / turn));
}

//: piece_of
/* The cubic of a curve in which a place is: T = (hold, n, places, four coefficients a piece); how far behind its begin. */
static const double *piece_of(double x, const double *T, double *behind)
{
    const int n = (int)T[1];
    int low = 0, high = n - 1;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (x < T[2 + middle])
            high = middle;
        else
            low = middle;
    }
    *behind = x - T[2 + low];
    return T + 2 + n + 4 * low;
}

//: lookup piece_of
/* The value of a curve, constant beyond its ends. */
static double lookup(double x, const double *T)
{
    const int n = (int)T[1];
    double s;
    if (x != x)
        return x;
    const double *c = piece_of(x < T[2] ? T[2] : x > T[n + 1] ? T[n + 1] : x, T, &s);
    return c[3] + s * (c[2] + s * (c[1] + s * c[0]));
}

//: lookup_slope piece_of
static double lookup_slope(double x, const double *T)
{
    const int n = (int)T[1];
    double s;
    if (!(x >= T[2] && x <= T[n + 1]))
        return 0.0;
    const double *c = piece_of(x, T, &s);
    return c[2] + s * (2.0 * c[1] + s * 3.0 * c[0]);
}

//: lookup_bend piece_of
/* Its second derivative. */
static double lookup_bend(double x, const double *T)
{
    const int n = (int)T[1];
    double s;
    if (!(x >= T[2] && x <= T[n + 1]))
        return 0.0;
    const double *c = piece_of(x, T, &s);
    return 2.0 * c[1] + s * 6.0 * c[0];
}

//: lookup_third piece_of
static double lookup_third(double x, const double *T)
{
    const int n = (int)T[1];
    double s;
    if (!(x >= T[2] && x <= T[n + 1]))
        return 0.0;
    return 6.0 * piece_of(x, T, &s)[0];
}

//: dot
/* a . b by eight sums side by side, which become vector instructions that do not wait for each other, in the ways that compilers
   see it by; to the bit the same. */
#if defined(__clang__)
#if defined(__AVX__)
typedef double lanes __attribute__((vector_size(32), aligned(8)));
#else
typedef double lanes __attribute__((vector_size(16), aligned(8)));
#endif
enum { WIDE = sizeof(lanes) / sizeof(double) };
static double dot(const double *restrict a, const double *restrict b, int n)
{
    lanes sums[8 / WIDE] = {{0.0}};
    const double *const s = (const double *)sums;
    int i = 0;
    for (; i + 8 <= n; i += 8)
        for (int l = 0; l < 8 / WIDE; l++)
            sums[l] += *(const lanes *)(a + i + WIDE * l) * *(const lanes *)(b + i + WIDE * l);
    double total = ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
    for (; i < n; i++)
        total += a[i] * b[i];
    return total;
}
#else
static double dot(const double *restrict a, const double *restrict b, int n)
{
    double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0, s4 = 0.0, s5 = 0.0, s6 = 0.0, s7 = 0.0;
    int i = 0;
    for (; i + 8 <= n; i += 8) {
        s0 += a[i] * b[i];
        s1 += a[i + 1] * b[i + 1];
        s2 += a[i + 2] * b[i + 2];
        s3 += a[i + 3] * b[i + 3];
        s4 += a[i + 4] * b[i + 4];
        s5 += a[i + 5] * b[i + 5];
        s6 += a[i + 6] * b[i + 6];
        s7 += a[i + 7] * b[i + 7];
    }
    double total = ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7));
    for (; i < n; i++)
        total += a[i] * b[i];
    return total;
}
#endif

//: add_row
/* y += f a. */
static void add_row(double f, const double *restrict a, double *restrict y, int n)
{
    for (int i = 0; i < n; i++)
        y[i] += f * a[i];
}

