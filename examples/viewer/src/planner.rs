//! Plans, fitted on a thread of their own.

use std::sync::Arc;
use std::thread;
use std::time::Instant;

use subsurface::{Plan, Profile};
use subsurface_lab::Error;

/// What a plan is to be made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    pub profile: Profile,
    pub max_error: f32,
}

/// The end of a fit.
pub struct Fitted {
    wish: Wish,
    plan: Result<Plan, Error>,
    seconds: f64,
}

/// Fits one plan at a time, and keeps the last one until the next is there.
pub struct Planner {
    /// Hands a plan back to the thread that asked.
    done: Arc<dyn Fn(Fitted) + Send + Sync>,
    fitting: Option<Wish>,
    /// What `plan` or `error` is of.
    fitted: Option<Wish>,
    pub plan: Option<Arc<Plan>>,
    pub error: Option<Error>,
    pub seconds: f64,
}

impl Planner {
    pub fn new(done: impl Fn(Fitted) + Send + Sync + 'static) -> Self {
        Self { done: Arc::new(done), fitting: None, fitted: None, plan: None, error: None, seconds: 0.0 }
    }

    /// Starts on a plan, unless it is there or another is being fitted: ask again when that is done.
    pub fn ask(&mut self, wish: Wish) {
        if self.fitting.is_some() || self.has(&wish) {
            return;
        }
        self.fitting = Some(wish);
        let done = Arc::clone(&self.done);
        thread::spawn(move || {
            let since = Instant::now();
            let plan = Plan::new(&[wish.profile], wish.max_error).map_err(Error::from);
            let seconds = since.elapsed().as_secs_f64();
            done(Fitted { wish, plan, seconds });
        });
    }

    pub fn take(&mut self, fitted: Fitted) {
        self.fitting = None;
        self.fitted = Some(fitted.wish);
        self.seconds = fitted.seconds;
        match fitted.plan {
            Ok(plan) => (self.plan, self.error) = (Some(Arc::new(plan)), None),
            Err(error) => self.error = Some(error),
        }
    }

    /// Whether the last fit is of this.
    pub fn has(&self, wish: &Wish) -> bool {
        self.fitted.as_ref() == Some(wish)
    }

    pub fn is_fitting(&self) -> bool {
        self.fitting.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[test]
    fn the_old_plan_stays_until_the_new_one_is_there() {
        let (sender, fits) = mpsc::channel();
        let mut planner = Planner::new(move |fitted| {
            // The test may have failed and gone.
            let _ = sender.send(fitted);
        });
        let wish = |max_error| Wish { profile: Profile::SKIN, max_error };
        planner.ask(wish(0.1));
        assert!(planner.is_fitting() && planner.plan.is_none());
        planner.take(fits.recv().unwrap());
        assert!(planner.has(&wish(0.1)) && !planner.is_fitting());

        planner.ask(wish(0.2));
        planner.ask(wish(0.3)); // not at the same time
        let error = |planner: &Planner| planner.plan.as_ref().map(|p| p.max_error());
        assert_eq!(error(&planner), Some(0.1));
        planner.take(fits.recv().unwrap());
        assert_eq!(error(&planner), Some(0.2));
        planner.ask(wish(0.2));
        assert!(!planner.is_fitting());

        // What no plan keeps is refused, as what is no error is.
        for refused in [1e-6, -1.0] {
            planner.ask(wish(refused));
            planner.take(fits.recv().unwrap());
            assert!(planner.error.is_some() && error(&planner) == Some(0.2));
        }
    }
}
